//! Power: all of it against the flux, and that through squares against what paths find there.

use kilauea_accel::Ray;
use kilauea_math::{DVec3, Frame, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::{Light, LightShape};
use kilauea_testing::{Family, Moments, project, uniforms, welch_p};
use std::f32::consts::PI;

use super::cases::{BLOCK, block, cases, emitter, prepare};
use crate::PreparedScene;
use crate::light::{ByImportance, Receiver};
use crate::statistics::lights::{light, turned};

const N_DRAWS: u32 = 8_000;

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
            let picked = lights.choose(receiver, choice, ByImportance);
            let u = Vec2::new(c, d);
            let light = picked.and_then(|p| lights.sample(p, receiver, u, geometry, textures));
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
        let targets = if case.is_small() {
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
    let prepared = prepare(lights, &block(), "Matte", Vec::new());
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
        (prepare(vec![dark], &block(), "Matte", Vec::new()), true),
        (prepare(Vec::new(), &block(), "Matte", Vec::new()), true),
        (
            prepare(vec![light(distant, turned())], &[], "Matte", Vec::new()),
            true,
        ),
        (
            prepare(vec![light(sphere, turned())], &block(), "Matte", Vec::new()),
            false,
        ),
    ] {
        assert_eq!(emitter(&prepared).is_empty(), is_empty);
    }
}
