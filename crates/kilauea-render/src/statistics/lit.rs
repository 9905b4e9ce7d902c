//! Lights as a point sees them: what is drawn toward them, and what a ray finds there.

use kilauea_accel::Ray;
use kilauea_math::{DVec3, Frame, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::{
    Camera, Channel, Input, Light, Material, MeshChunk, Node, Prototype, Scene, TextureSource,
    Visibility,
};
use kilauea_testing::{
    Comparison, Directions, Draw, Moments, compare, integrate_over, project, uniforms,
};

use crate::geometry::View;
use crate::integrator::power_heuristic;
use crate::light::{ByImportance, ChosenLight, Emitted, LightChooser, LightSample, Receiver};
use crate::{PrepareOptions, PreparedScene};

const N_DRAWS: u32 = 8_000;

/// What tests ask of lights at a point. They plant faults by putting something else in its place.
pub(super) trait Sees {
    /// A direction toward a light.
    fn sample(&self, u: [f32; 3]) -> Option<ChosenLight>;

    /// Visits all light that arrives from a direction, each with the density stated for it.
    fn for_each_arriving(&self, dir: Vec3, visit: impl FnMut(&Emitted));

    /// Normal of the point.
    fn n(&self) -> Vec3;
}

/// A point that lights shine on.
pub(super) struct Lit<'a, C = ByImportance> {
    pub(super) prepared: &'a PreparedScene,
    pub(super) receiver: Receiver,
    /// How lights are chosen there.
    pub(super) chooser: C,
}

impl<C: LightChooser> Sees for Lit<'_, C> {
    fn sample(&self, [choice, x, y]: [f32; 3]) -> Option<ChosenLight> {
        let PreparedScene {
            lights,
            geometry,
            textures,
            ..
        } = self.prepared;
        let picked = lights.choose(self.receiver, choice, self.chooser)?;
        lights.sample(picked, self.receiver, Vec2::new(x, y), geometry, textures)
    }

    fn for_each_arriving(&self, dir: Vec3, mut visit: impl FnMut(&Emitted)) {
        let PreparedScene {
            lights,
            geometry,
            textures,
            ..
        } = self.prepared;
        // A sample without light is no sample.
        let mut visit_bright = |e: Emitted| {
            if !e.radiance.is_black() {
                visit(&e);
            }
        };
        let ray = Ray::new(self.receiver.p, dir);
        let receiver = Some(self.receiver);
        lights.for_each_area_hit(&ray, receiver, self.chooser, textures, |_, e| {
            visit_bright(e);
        });
        lights.for_each_infinite(dir, receiver, self.chooser, textures, &mut visit_bright);
        if let Some(hit) = geometry.accel().intersect(&ray) {
            let view = View {
                uv: Vec2::new(hit.u, hit.v),
                p_ray: ray.at(hit.t),
                wo: -dir,
                time: 0.0,
                footprint: 0.0,
            };
            let interaction = geometry.interaction(geometry.locate(&hit), &view, textures);
            let emitted = lights.emitted_by_surface(&interaction, hit.t, receiver, self.chooser);
            emitted.into_iter().for_each(visit_bright);
        }
    }

    fn n(&self) -> Vec3 {
        self.receiver.n
    }
}

/// Directions that are drawn against the densities that rays find.
pub(super) fn compare_density(
    seen: &impl Sees,
    directions: &Directions,
    stream: u32,
) -> Comparison {
    let draw = |i| match seen.sample(uniforms(stream, i)) {
        None => Draw::Lost,
        Some(ChosenLight { sample, .. }) if sample.is_delta => Draw::Atom {
            idx: sample.pdf.to_bits(),
            probability: f64::from(sample.pdf),
        },
        Some(ChosenLight { sample, .. }) => Draw::At(sample.wi),
    };
    let density = |dir| {
        let mut density = 0.0;
        seen.for_each_arriving(dir, |e| density += f64::from(e.pdf));
        density
    };
    compare(directions, N_DRAWS, draw, density)
}

/// How often the irradiance by draws would be as far from the integral of the radiance that rays
/// find where draws have a density. Without delta lights.
pub(super) fn irradiance_p_value(seen: &impl Sees, directions: &Directions, stream: u32) -> f64 {
    let draws: Vec<f64> = (0..N_DRAWS)
        .map(|i| irradiance_by_draw(seen, uniforms(stream, i), |_| 1.0))
        .collect();
    integral_p_value(&draws, seen, directions, |e| e.pdf > 0.0)
}

/// How often the irradiance by draws and by rays of a diffuse surface together, each weighted
/// against the other, would be as far from the integral of all radiance that rays find. Without
/// delta lights.
pub(super) fn combined_irradiance_p_value(
    seen: &impl Sees,
    directions: &Directions,
    stream: u32,
) -> f64 {
    let frame = Frame::from_z(seen.n());
    let cosine_pdf = |wi: Vec3| warp::cosine_hemisphere_pdf(wi.dot(seen.n()));
    let of_draw = |i| {
        irradiance_by_draw(seen, uniforms(stream, i), |sample| {
            power_heuristic(sample.pdf, cosine_pdf(sample.wi))
        })
    };
    let of_ray = |i| {
        let [x, y] = uniforms(stream + 1, i);
        let wi = frame.from_local(warp::cosine_hemisphere(Vec2::new(x, y)));
        let pdf = cosine_pdf(wi);
        let mut sum = 0.0;
        seen.for_each_arriving(wi, |e| {
            let weight = f64::from(power_heuristic(pdf, e.pdf));
            sum += weight * reflected(seen, wi, e.radiance) / f64::from(pdf);
        });
        sum
    };
    let draws: Vec<f64> = (0..N_DRAWS).map(|i| of_draw(i) + of_ray(i)).collect();
    integral_p_value(&draws, seen, directions, |_| true)
}

/// Irradiance by one draw, weighted. Without delta lights.
fn irradiance_by_draw(seen: &impl Sees, u: [f32; 3], weight: impl Fn(&LightSample) -> f32) -> f64 {
    let light = seen.sample(u).filter(|l| !l.sample.is_delta);
    light.map_or(0.0, |ChosenLight { sample, .. }| {
        let irradiance = reflected(seen, sample.wi, sample.radiance) / f64::from(sample.pdf);
        f64::from(weight(&sample)) * irradiance
    })
}

/// What radiance from a direction adds to irradiance, per solid angle.
fn reflected(seen: &impl Sees, wi: Vec3, radiance: Spectrum) -> f64 {
    project(radiance) * f64::from(wi.dot(seen.n()).max(0.0))
}

/// How often the mean of samples would be as far from the integral of some of the light that arrives.
fn integral_p_value(
    samples: &[f64],
    seen: &impl Sees,
    directions: &Directions,
    is_some: impl Fn(&Emitted) -> bool,
) -> f64 {
    let moments = Moments::of(samples);
    let along = |dir: Vec3| {
        let mut sum = 0.0;
        seen.for_each_arriving(dir, |e| {
            if is_some(e) {
                sum += reflected(seen, dir, e.radiance);
            }
        });
        sum
    };
    let integral = integrate_over(directions, 3e-5 * moments.mean, along);
    moments.p_value(integral, 1e-3 * integral)
}

/// The share of drawn light whose radiance or density is not what a ray in its direction finds.
pub(super) fn share_not_found(seen: &impl Sees, stream: u32) -> f64 {
    let is_near = |a: f32, b: f32| (a - b).abs() <= 0.01 * b;
    let is_found = |light: &ChosenLight| {
        let sample = &light.sample;
        let mut is_found = false;
        seen.for_each_arriving(sample.wi, |e| {
            is_found |= is_near(e.pdf, sample.pdf)
                && is_near(e.radiance.luminance(), sample.radiance.luminance())
                && (e.diffuse, e.specular) == (light.diffuse, light.specular);
        });
        is_found
    };
    let (mut drawn, mut not_found) = (0.0, 0.0);
    for light in (0..N_DRAWS).filter_map(|i| seen.sample(uniforms(stream, i))) {
        if !light.sample.is_delta {
            let carried = 1.0 / f64::from(light.sample.pdf);
            drawn += carried;
            not_found += if is_found(&light) { 0.0 } else { carried };
        }
    }
    not_found / f64::max(drawn, f64::MIN_POSITIVE)
}

/// A scene of lights, and of triangles that shine with radiance one.
pub(super) fn prepare(
    lights: Vec<Light>,
    triangles: &[[Vec3; 3]],
    textures: Vec<TextureSource>,
) -> PreparedScene {
    let chunk = MeshChunk {
        positions: triangles.iter().flatten().map(Vec3::to_array).collect(),
        triangles: (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        visibility: Visibility::ALL,
        ..MeshChunk::default()
    };
    let scene = Scene {
        origin_world: DVec3::ZERO,
        prim_paths: vec!["/Mesh".into()],
        prototypes: vec![Prototype {
            chunks: if triangles.is_empty() {
                Vec::new()
            } else {
                vec![chunk]
            },
            ..Prototype::default()
        }],
        materials: vec![glowing()],
        textures,
        lights,
        camera: Camera::default(),
    };
    PreparedScene::new(scene, &PrepareOptions::default()).expect("the scene is sound")
}

pub(crate) fn glowing() -> Material {
    let input = Input {
        node: 0,
        channel: Channel::Rgb,
    };
    Material {
        path: "/Material".into(),
        shader: "UsdPreviewSurface".into(),
        inputs: [("emissiveColor".into(), input)].into(),
        nodes: vec![Node::Constant { value: [1.0; 4] }],
    }
}
