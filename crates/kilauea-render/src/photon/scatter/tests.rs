//! Light that goes one way is scattered as camera paths are that go the other way.

use kilauea_bsdf::{Bsdf, Layers};
use kilauea_math::{Frame, Spectrum, Vec2, Vec3, warp};
use kilauea_testing::{Family, Moments, project, uniforms, welch_p};

use super::sample_adjoint;

const N: u32 = 60_000;

/// A direction on the side of `n`, by cosine.
fn over_hemisphere(n: Vec3, [x, y]: [f32; 2]) -> Vec3 {
    Frame::from_z(n).from_local(warp::cosine_hemisphere(Vec2::new(x, y)))
}

/// Brightness of the light that comes from a direction.
fn light(wi: Vec3) -> f64 {
    f64::from(1.0 + wi.x + 0.5 * wi.z * wi.z)
}

/// How much a camera sees of what goes into a direction.
fn camera(wo: Vec3) -> f64 {
    f64::from(1.0 - 0.8 * wo.x + 0.3 * wo.y)
}

/// ∫∫ light(wi) f(wi → wo) camera(wo) over the projected solid angles of both, which is the same
/// whichever end paths start from: samples of a path from the light, and of one from the camera.
fn both_ways(bsdf: &Bsdf, ng: Vec3, lit: Vec3, stream: u32) -> [Moments; 2] {
    let from_light = |i| {
        let [a, b, c, d, e] = uniforms(stream, i);
        let wi = over_hemisphere(lit, [a, b]);
        let scattered = sample_adjoint(bsdf, &bsdf.seen_from(wi), ng, wi, [c, d, e]);
        scattered.map_or(0.0, |s| {
            light(wi) * project(s.diffuse + s.specular) * camera(s.wo)
        })
    };
    let from_camera = |side: Vec3, i| {
        let [a, b, c, d, e] = uniforms(stream + 1000, i);
        let wo = over_hemisphere(side, [a, b]);
        let sample = bsdf.seen_from(wo).sample([c, d, e]);
        sample
            .filter(|s| s.wi.dot(lit) > 0.0)
            .map_or(0.0, |s| light(s.wi) * project(s.weight()) * camera(wo))
    };
    // A camera sees the light that is reflected, or that is refracted.
    let seen = |i| from_camera(lit, i) + from_camera(-lit, i + N);
    [
        Moments::of(&(0..N).map(from_light).collect::<Vec<_>>()),
        Moments::of(&(0..N).map(seen).collect::<Vec<_>>()),
    ]
}

#[test]
fn photons_scatter_as_camera_paths_do_the_other_way() {
    let ng = Vec3::Z;
    let tilted = Frame::from_z(Vec3::new(0.3, -0.2, 1.0).normalize());
    let straight = Frame::from_z(ng);
    let plastic = Layers {
        diffuse: Spectrum::new(0.6, 0.4, 0.2),
        f0: Spectrum::splat(0.04),
        f90: Spectrum::ONE,
        roughness: 0.5,
        ..Layers::default()
    };
    let coated = Layers {
        coat: 1.0,
        coat_roughness: 0.3,
        ..plastic
    };
    let metal = Layers {
        f0: Spectrum::new(0.9, 0.6, 0.3),
        f90: Spectrum::ONE,
        roughness: 0.4,
        ..Layers::default()
    };
    let mirror = Layers {
        roughness: 0.0,
        ..metal
    };
    let mut family = Family::new("scattering both ways");
    for (name, frame) in [("straight", straight), ("tilted", tilted)] {
        let grey = Bsdf::lambert(frame, ng, Spectrum::new(0.8, 0.5, 0.3));
        let layered = |layers: &Layers| Bsdf::layered(frame, ng, layers);
        for (what, bsdf) in [
            ("Lambert", grey),
            ("plastic", layered(&plastic)),
            ("coated plastic", layered(&coated)),
            ("metal", layered(&metal)),
            ("mirror", layered(&mirror)),
        ] {
            for lit in [ng, -ng] {
                let [a, b] = both_ways(&bsdf, ng, lit, 10 * family.len() as u32);
                let p = welch_p(&a, &b, 1e-3 * b.mean);
                family.add(format!("{what}, {name}: {} {}", a.mean, b.mean), p);
            }
        }
    }
    family.check();
}

/// Camera paths carry L/η², photons power: projected solid angles shrink by η² into the glass.
#[test]
fn refracted_photons_keep_their_power() {
    let (ng, ior) = (Vec3::Z, 1.5_f64);
    let bsdf = Bsdf::dielectric(Frame::from_z(ng), ng, ior as f32);
    let mut family = Family::new("refraction both ways");
    for (lit, factor) in [(ng, ior * ior), (-ng, 1.0 / (ior * ior))] {
        let refracted_from_light = |i| {
            let [a, b, c, d, e] = uniforms(5, i);
            let wi = over_hemisphere(lit, [a, b]);
            let scattered = sample_adjoint(&bsdf, &bsdf.seen_from(wi), ng, wi, [c, d, e]);
            scattered
                .filter(|s| s.is_transmission)
                .map_or(0.0, |s| light(wi) * project(s.specular) * camera(s.wo))
        };
        let refracted_from_camera = |i| {
            let [a, b, c, d, e] = uniforms(6, i);
            let wo = over_hemisphere(-lit, [a, b]);
            let sample = bsdf.seen_from(wo).sample([c, d, e]);
            sample.filter(|s| s.is_transmission).map_or(0.0, |s| {
                factor * light(s.wi) * project(s.weight()) * camera(wo)
            })
        };
        let a = Moments::of(&(0..N).map(refracted_from_light).collect::<Vec<_>>());
        let b = Moments::of(&(0..N).map(refracted_from_camera).collect::<Vec<_>>());
        let p = welch_p(&a, &b, 1e-3 * b.mean);
        family.add(format!("{lit}: {} {}", a.mean, b.mean), p);
    }
    family.check();
}
