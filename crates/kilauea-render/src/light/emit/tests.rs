//! Photons of each kind of light, against the densities stated for them and against what the light
//! sends to a receiver by the estimate of paths.

use kilauea_accel::Ray;
use kilauea_math::{DMat4, DVec3, Frame, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::{
    Light, LightShape, Material, MeshChunk, Prototype, Scene, Shaping, TextureSource,
};
use kilauea_testing::{
    Directions, Draw, Family, Moments, Rectangle, compare, project, uniforms, welch_p,
};
use std::f32::consts::PI;

use super::{Emitter, LightRay};
use crate::light::{InfiniteLight, Receiver};
use crate::statistics::lights::{light, sunny, turned};
use crate::statistics::lit::{camera, glowing};
use crate::{PrepareOptions, PreparedScene};

const N_DRAWS: u32 = 8_000;

/// A scene of one light and, off it, a block that is lit.
struct Case {
    name: &'static str,
    prepared: PreparedScene,
    /// Watts in each channel, where there is a formula.
    flux: Option<f64>,
}

/// A block between these corners.
const BLOCK: [Vec3; 2] = [Vec3::new(-1.0, -2.5, -3.0), Vec3::new(2.0, -1.5, 1.0)];

fn case(name: &'static str, lights: Vec<Light>, flux: impl Into<Option<f64>>) -> Case {
    Case {
        name,
        prepared: prepare(lights, block(), "Matte", Vec::new()),
        flux: flux.into(),
    }
}

fn prepare(
    lights: Vec<Light>,
    triangles: Vec<[Vec3; 3]>,
    shader: &str,
    textures: Vec<TextureSource>,
) -> PreparedScene {
    let matte = Material {
        path: "/Material".into(),
        shader: shader.into(),
        ..glowing()
    };
    let chunk = MeshChunk {
        positions: triangles.iter().flatten().map(Vec3::to_array).collect(),
        triangles: (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        ..MeshChunk::default()
    };
    let scene = Scene {
        origin_world: DVec3::ZERO,
        prim_paths: vec!["/Mesh".into()],
        prototypes: vec![Prototype {
            chunks: vec![chunk],
            ..Prototype::default()
        }],
        materials: vec![matte],
        textures,
        lights,
        camera: camera(),
    };
    PreparedScene::new(scene, &PrepareOptions::default()).expect("the scene is sound")
}

/// Two triangles that span a block.
fn block() -> Vec<[Vec3; 3]> {
    let [min, max] = BLOCK;
    let corner = |x: f32, y: f32, z: f32| min + (max - min) * Vec3::new(x, y, z);
    vec![
        [
            corner(0.0, 0.0, 0.0),
            corner(1.0, 0.0, 0.0),
            corner(0.0, 0.0, 1.0),
        ],
        [
            corner(1.0, 1.0, 1.0),
            corner(0.0, 1.0, 1.0),
            corner(1.0, 1.0, 0.0),
        ],
    ]
}

fn cases() -> Vec<Case> {
    let scaled = |x, y, z| turned() * DMat4::from_scale(DVec3::new(x, y, z));
    let shear = DMat4::from_cols_array_2d(&[
        [1.0, 0.4, 0.0, 0.0],
        [0.3, 1.2, 0.0, 0.0],
        [0.1, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);
    let rect = LightShape::Rect {
        width: 1.2,
        height: 0.7,
    };
    let disk = LightShape::Disk { radius: 0.5 };
    let sphere = LightShape::Sphere { radius: 0.5 };
    let cylinder = LightShape::Cylinder {
        radius: 0.15,
        length: 1.4,
    };
    let distant = |angle_degrees| LightShape::Distant { angle_degrees };
    let shaping = Shaping {
        cone_angle_degrees: 40.0,
        cone_softness: 0.3,
        focus: 2.0,
        focus_tint: Spectrum::BLACK,
    };
    let shaped = |shape, place| Light {
        shaping: Some(shaping.clone()),
        ..light(shape, place)
    };
    let pi = f64::from(PI);
    // Sheared, 1.2 x 0.7 is spanned by vectors with a cross product of length 1.08 times that.
    let mut cases = vec![
        case("rect", vec![light(rect, turned())], pi * 0.84),
        case(
            "sheared rect",
            vec![light(rect, turned() * shear)],
            pi * 0.84 * 1.08,
        ),
        case("disk", vec![light(disk, turned())], pi * pi * 0.25),
        case(
            "ellipse",
            vec![light(disk, scaled(1.2, 0.5, 2.0))],
            pi * pi * 0.25 * 0.6,
        ),
        case("sphere", vec![light(sphere, turned())], pi * pi),
        case(
            "ellipsoid",
            vec![light(sphere, scaled(1.2, 0.4, 0.8))],
            None,
        ),
        case(
            "cylinder",
            vec![light(cylinder, turned())],
            pi * 2.0 * pi * 0.15 * 1.4,
        ),
        case(
            "flat cylinder",
            vec![light(cylinder, scaled(1.0, 3.0, 0.5))],
            None,
        ),
        case("sun", vec![light(distant(0.53), turned())], None),
        case("parallel", vec![light(distant(0.0), turned())], None),
        case("wide distant", vec![light(distant(50.0), turned())], None),
        case("dome", vec![light(LightShape::Dome, turned())], None),
        case("shaped sphere", vec![shaped(sphere, turned())], None),
        case("shaped disk", vec![shaped(disk, turned())], None),
        case(
            "shaped sheared rect",
            vec![shaped(rect, turned() * shear)],
            None,
        ),
    ];

    let sunny = sunny();
    for (name, shape) in [
        ("dome with a sun", LightShape::Dome),
        ("pictured rect", rect),
    ] {
        let light = Light {
            texture: Some(0),
            ..light(shape, turned())
        };
        cases.push(Case {
            name,
            prepared: prepare(vec![light], block(), "Matte", vec![sunny.source()]),
            flux: None,
        });
    }
    let corner = |x, y, z| turned().transform_point3(DVec3::new(x, y, z)).as_vec3();
    let triangle = [
        corner(-0.6, -0.3, 0.1),
        corner(0.5, -0.4, -0.1),
        corner(0.1, 0.6, 0.0),
    ];
    let area = 0.5
        * (triangle[1] - triangle[0])
            .cross(triangle[2] - triangle[0])
            .length();
    cases.push(Case {
        name: "triangle",
        prepared: prepare(Vec::new(), vec![triangle], "UsdPreviewSurface", Vec::new()),
        flux: Some(2.0 * pi * f64::from(area)),
    });
    cases
}

fn emitter(prepared: &PreparedScene) -> Emitter<'_> {
    Emitter::new(&prepared.lights, &prepared.geometry, &prepared.textures)
}

/// The only light's ray; rays of what does not shine there included.
fn leave(emitter: &Emitter<'_>, [a, b, c, d]: [f32; 4]) -> Option<LightRay> {
    let ray = emitter.leave(0, Vec2::new(a, b), Vec2::new(c, d));
    ray.map(|leaving| leaving.chosen)
}

/// The density of a direction by code that does not draw.
fn direction_pdf(prepared: &PreparedScene, dir: Vec3) -> f64 {
    let lights = &prepared.lights;
    let pdf = if let Some(area) = lights.area.first() {
        // Directions in which a light does not shine are lost.
        let shines = area.cross_section(dir).is_some();
        if shines {
            area.emission_cone().pdf(dir)
        } else {
            0.0
        }
    } else {
        match lights.infinite.first() {
            Some(InfiniteLight::Distant(l)) => l.radiance_and_pdf(-dir).map_or(0.0, |(_, pdf)| pdf),
            Some(InfiniteLight::Dome(l)) => {
                let (_, pdf) = l.radiance_and_pdf(None, -dir, &prepared.textures);
                // Where there is no picture, all directions are as likely.
                if pdf > 0.0 { pdf } else { 0.25 / PI }
            }
            None => {
                let corner = |i: usize| Vec3::from_array(first_chunk(prepared).positions[i]);
                let n = (corner(1) - corner(0)).cross(corner(2) - corner(0));
                dir.dot(n.normalize()).abs() / (2.0 * PI)
            }
        }
    };
    f64::from(pdf)
}

fn first_chunk(prepared: &PreparedScene) -> &MeshChunk {
    &prepared.scene.prototypes[0].chunks[0]
}

/// Whether a line in the unit direction `dir` through `p` starts at the light.
fn is_lit(prepared: &PreparedScene, p: Vec3, dir: Vec3) -> bool {
    let back = Ray::new(p + 20.0 * dir, -dir);
    let lights = &prepared.lights;
    if lights.has_area_lights() {
        let mut is_met = false;
        lights.for_each_area_hit(&back, None, &prepared.textures, |_, _| is_met = true);
        return is_met;
    }
    if lights.infinite.is_empty() {
        return prepared.geometry.accel().intersect(&back).is_some();
    }
    let [min, max] = BLOCK;
    let (a, b) = ((min - p) / dir, (max - p) / dir);
    a.min(b).max_element() <= a.max(b).min_element()
}

#[test]
fn directions_are_drawn_with_their_density() {
    let mut family = Family::new("directions of photons");
    for case in cases() {
        let emitter = emitter(&case.prepared);
        let draw = |i| match leave(&emitter, uniforms(family.len() as u32, i)) {
            Some(ray) if case.name == "parallel" => Draw::Atom {
                idx: 0,
                probability: f64::from(ray.pdf_direction),
            },
            Some(ray) => Draw::At(ray.dir),
            None => Draw::Lost,
        };
        let light_z = turned().transform_vector3(DVec3::NEG_Z).as_vec3();
        let half_angle = if case.name == "sun" { 0.005 } else { 1.0 };
        let directions =
            Directions::around(light_z + 0.3 * half_angle * Vec3::X, half_angle as f64);
        let found = compare(&directions, N_DRAWS, draw, |dir| {
            direction_pdf(&case.prepared, dir)
        });
        family.add(format!("{}: {found:?}", case.name), found.p_value());
    }
    family.check();
}

#[test]
fn rays_state_the_density_of_their_direction() {
    for case in cases().iter().filter(|case| case.name != "parallel") {
        let emitter = emitter(&case.prepared);
        for i in 0..200 {
            if let Some(ray) = leave(&emitter, uniforms(3, i)) {
                let pdf = direction_pdf(&case.prepared, ray.dir);
                let stated = f64::from(ray.pdf_direction);
                assert!(
                    (stated / pdf - 1.0).abs() < 0.01,
                    "{}: {stated} {pdf}",
                    case.name
                );
            }
        }
    }
}

#[test]
fn points_are_even_over_the_cross_section() {
    let mut family = Family::new("points of photons");
    for case in cases() {
        let emitter = emitter(&case.prepared);
        for k in 0..1 {
            let [a, b] = uniforms(11 + k, 5);
            let Some(first) = leave(&emitter, [a, b, 0.5, 0.5]) else {
                continue;
            };
            let plane = Frame::from_z(first.dir);
            let flat = |p: Vec3| plane.to_local(p).truncate();
            let center = flat(first.p);
            // Off the center, so that no symmetry hides an error.
            let reach = Vec2::new(3.1, 2.9) * if family_is_small(&case) { 0.4 } else { 2.0 };
            let domain = Rectangle {
                min: center - reach,
                max: center + reach * 1.07,
            };
            let stream = 100 + family.len() as u32;
            let draw = |i| {
                let [c, d] = uniforms(stream, i);
                leave(&emitter, [a, b, c, d]).map_or(Draw::Lost, |ray| Draw::At(flat(ray.p)))
            };
            let found = compare(&domain, N_DRAWS, draw, |at: Vec2| {
                let p = plane.from_local(at.extend(0.0));
                let is_lit = is_lit(&case.prepared, p, first.dir);
                if is_lit {
                    1.0 / f64::from(first.cross_section)
                } else {
                    0.0
                }
            });
            family.add(format!("{}: {found:?}", case.name), found.p_value());
        }
    }
    family.check();
}

/// Whether the rays of a case start within a radius of one and not all around the block.
fn family_is_small(case: &Case) -> bool {
    case.prepared.lights.infinite.is_empty()
}

#[test]
fn the_power_of_all_photons_is_the_flux() {
    let mut family = Family::new("flux");
    for case in cases() {
        let Some(flux) = case.flux else { continue };
        let powers = powers(&case.prepared, 41, |_| true);
        let p = Moments::of(&powers).p_value(project(Spectrum::splat(flux as f32)), 1e-4 * flux);
        family.add(case.name, p);
    }
    assert!(family.len() >= 6);
    family.check();
}

/// The power of each photon whose ray is counted, and zeros for the others.
fn powers(prepared: &PreparedScene, stream: u32, is_counted: impl Fn(&Ray) -> bool) -> Vec<f64> {
    let emitter = emitter(prepared);
    let power = |i| {
        let [a, b, c, d, e, f] = uniforms(stream, i);
        let photon = emitter.emit(Vec2::new(a, b), Vec2::new(c, d), Vec2::new(e, f));
        photon
            .filter(|photon| is_counted(&photon.ray))
            .map_or(0.0, |photon| project(photon.power))
    };
    (0..4 * N_DRAWS).map(power).collect()
}

/// A square that receives light on one side.
struct Target {
    center: Vec3,
    frame: Frame,
    half_width: f32,
}

impl Target {
    fn is_crossed(&self, ray: &Ray) -> bool {
        let o = self.frame.to_local(ray.origin - self.center);
        let d = self.frame.to_local(ray.dir);
        let p = o + d * (-o.z / d.z);
        d.z < 0.0 && o.z > 0.0 && p.truncate().abs().max_element() <= self.half_width
    }

    /// Estimates of the power that arrives, by sampling lights as paths do.
    fn arriving(&self, prepared: &PreparedScene, stream: u32) -> Vec<f64> {
        let PreparedScene {
            lights,
            geometry,
            textures,
            ..
        } = prepared;
        let area = f64::from(4.0 * self.half_width * self.half_width);
        let power = |i| {
            let [a, b, choice, c, d] = uniforms(stream, i);
            let at = (2.0 * Vec2::new(a, b) - 1.0) * self.half_width;
            let receiver = Receiver {
                p: self.center + self.frame.from_local(at.extend(0.0)),
                n: self.frame.z,
            };
            let light = lights.sample(receiver, choice, Vec2::new(c, d), geometry, textures);
            light.map_or(0.0, |light| {
                let cosine = light.sample.wi.dot(receiver.n).max(0.0);
                area * project(light.sample.radiance * (cosine / light.sample.pdf))
            })
        };
        (0..4 * N_DRAWS).map(power).collect()
    }
}

#[test]
fn photons_bring_what_paths_find_at_a_receiver() {
    let mut family = Family::new("power through a square");
    let mut n_arriving = 0;
    for case in cases() {
        let place = turned();
        // Before the light and aside of it, within the block that is lit.
        let targets = if family_is_small(&case) {
            [(0.1, 0.05, -0.9), (0.8, -0.6, -0.7), (-0.3, 0.9, -0.4)]
                .map(|(x, y, z)| place.transform_point3(DVec3::new(x, y, z)).as_vec3())
        } else {
            [0.2, 0.5, 0.8].map(|t| BLOCK[0].lerp(BLOCK[1], t))
        };
        for (i, center) in targets.into_iter().enumerate() {
            let toward_light = place.transform_vector3(DVec3::Z).as_vec3();
            let [a, b] = uniforms(19, i as u32);
            let n = toward_light + 0.6 * warp::uniform_sphere(Vec2::new(a, b));
            let target = Target {
                center,
                frame: Frame::from_z(n.normalize()),
                half_width: 0.2,
            };
            let stream = 200 + family.len() as u32;
            let photons = powers(&case.prepared, stream, |ray| target.is_crossed(ray));
            let paths = target.arriving(&case.prepared, stream);
            let [photons, paths] = [photons, paths].map(|values| Moments::of(&values));
            family.add(
                format!("{}: {} {}", case.name, photons.mean, paths.mean),
                welch_p(&photons, &paths, 2e-3 * paths.mean),
            );
            n_arriving += u32::from(photons.mean > 0.0);
        }
    }
    family.check();
    assert!(n_arriving as usize > family.len() * 9 / 10);
}

#[test]
fn lights_share_photons_by_power() {
    let disk = |radius, brightness| Light {
        radiance: Spectrum::splat(brightness),
        ..light(LightShape::Disk { radius }, turned())
    };
    // 1 : 4 : 0, and one without area.
    let lights = vec![
        disk(0.5, 1.0),
        disk(1.0, 1.0),
        disk(1.0, 0.0),
        disk(0.0, 1.0),
    ];
    let prepared = prepare(lights, block(), "Matte", Vec::new());
    let emitter = emitter(&prepared);
    let mut counts = [0_u32; 2];
    let mut powers = Vec::new();
    for i in 0..N_DRAWS {
        let [a, b, c, d, e, f] = uniforms(7, i);
        let photon = emitter
            .emit(Vec2::new(a, b), Vec2::new(c, d), Vec2::new(e, f))
            .expect("flat lights lose nothing");
        counts[photon.light as usize] += 1;
        powers.push(photon.power.luminance());
    }
    let share = f64::from(counts[0]) / f64::from(N_DRAWS);
    assert!((share - 0.2).abs() < 0.02, "{counts:?}");
    // All photons are equal.
    let flux = PI * PI * 1.25;
    assert!(powers.iter().all(|p| (p / flux - 1.0).abs() < 1e-4));
}

#[test]
fn nothing_leaves_where_there_is_no_light_or_no_surface() {
    let sphere = LightShape::Sphere { radius: 0.5 };
    let distant = LightShape::Distant { angle_degrees: 0.0 };
    let dark = Light {
        radiance: Spectrum::BLACK,
        ..light(sphere, turned())
    };
    for (prepared, is_empty) in [
        (prepare(vec![dark], block(), "Matte", Vec::new()), true),
        (prepare(Vec::new(), block(), "Matte", Vec::new()), true),
        (
            prepare(
                vec![light(distant, turned())],
                Vec::new(),
                "Matte",
                Vec::new(),
            ),
            true,
        ),
        (
            prepare(vec![light(sphere, turned())], block(), "Matte", Vec::new()),
            false,
        ),
    ] {
        assert_eq!(emitter(&prepared).is_empty(), is_empty);
    }
}
