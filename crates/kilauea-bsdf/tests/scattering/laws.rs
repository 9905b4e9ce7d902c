//! What every BSDF must hold for each pair of directions.

use kilauea_bsdf::{Bsdf, Layers};
use kilauea_math::{Frame, Spectrum, Vec3, warp};
use kilauea_testing::uniforms;

use crate::surfaces::{coated, flat, lambert, metal, tinted, white};

const ROUGHNESSES: [f32; 7] = [0.0, 0.04, 0.1, 0.3, 0.5, 0.8, 1.0];

fn wo_at(cos: f32) -> Vec3 {
    Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
}

/// A unit direction, uniform over the sphere.
fn direction(i: u32) -> Vec3 {
    let [u, v] = uniforms(1, i);
    warp::uniform_sphere([u, v].into())
}

fn numbers(i: u32) -> [f32; 3] {
    uniforms(0, i)
}

/// Every kind of surface at one roughness.
fn kinds(roughness: f32) -> impl Iterator<Item = (&'static str, Layers)> {
    let tinted = [("tinted", tinted(roughness))];
    white(roughness).into_iter().chain(tinted)
}

#[test]
fn weights_are_eval_over_pdf() {
    for roughness in ROUGHNESSES {
        for (name, layers) in kinds(roughness) {
            let bsdf = flat(&layers);
            for i in 0..200 {
                let wo = direction(i);
                let Some(s) = bsdf.sample(wo, numbers(i)) else {
                    continue;
                };
                if s.is_delta {
                    assert!(s.pdf <= 1.0 + 1e-5);
                    continue;
                }
                let eval = bsdf.eval(wo, s.wi);
                let case = format!("{name} {roughness}: {s:?} {eval:?}");
                assert!((s.pdf / eval.pdf - 1.0).abs() < 1e-3, "{case}");
                let difference = s.weight() * s.pdf - eval.total();
                assert!(
                    difference
                        .to_array()
                        .iter()
                        .all(|d| d.abs() <= 2e-3 * s.pdf),
                    "{case}"
                );
                assert_eq!(s.is_transmission, wo.z * s.wi.z < 0.0, "{case}");
            }
        }
    }
}

/// What diffuse lobes scatter is what they take of the light, times their albedo: so irradiance may be
/// summed over what is taken before it is known from where it is seen.
#[test]
fn diffuse_light_is_reception_times_albedo() {
    let by_parts = |bsdf: &Bsdf, wo: Vec3, wi: Vec3| {
        let albedo = bsdf.seen_from(wo).diffuse_albedo();
        albedo * bsdf.seen_from(wi).diffuse_reception() / std::f32::consts::PI
    };
    let surfaces = ROUGHNESSES.into_iter().flat_map(kinds);
    let surfaces = surfaces.map(|(name, layers)| (name, flat(&layers)));
    for (name, bsdf) in surfaces.chain([("lambert", lambert(0.6))]) {
        for i in 0..100 {
            let (wo, other) = (direction(i), direction(i + 100));
            // On one side.
            let wi = other * (other.z * wo.z).signum();
            let expected = bsdf.eval(wo, wi).diffuse;
            let difference = by_parts(&bsdf, wo, wi) - expected;
            let is_near = difference.to_array().iter().all(|d| d.abs() < 1e-5);
            assert!(is_near, "{name} {wo} {wi}: {difference:?} of {expected:?}");
        }
    }
}

/// Other lobes scatter the same without the diffuse ones, and are drawn as often as their density says.
#[test]
fn other_lobes_do_not_need_the_diffuse_ones() {
    assert!(lambert(0.5).seen_from(Vec3::Z).without_diffuse().is_none());
    for roughness in ROUGHNESSES {
        for (name, layers) in kinds(roughness) {
            let bsdf = flat(&layers);
            for i in 0..100 {
                let (wo, wi) = (direction(i), direction(i + 100));
                let all = bsdf.seen_from(wo);
                let case = format!("{name} {roughness} {wo}");
                let Some(others) = all.without_diffuse() else {
                    let albedo = all.albedo() - all.diffuse_albedo();
                    assert!(albedo.max_channel() < 1e-6, "{case}");
                    continue;
                };
                let eval = others.eval(wi);
                assert_eq!(eval.specular, all.eval(wi).specular, "{case}");
                assert_eq!(eval.diffuse, Spectrum::BLACK, "{case}");
                assert_eq!(others.diffuse_albedo(), Spectrum::BLACK, "{case}");
                let rest = all.albedo() - all.diffuse_albedo() - others.albedo();
                assert!(rest.to_array().iter().all(|d| d.abs() < 1e-5), "{case}");
                let Some(sample) = others.sample(numbers(i)) else {
                    continue;
                };
                assert!(!sample.is_diffuse, "{case}");
                if !sample.is_delta {
                    let pdf = others.eval(sample.wi).pdf;
                    assert!((sample.pdf / pdf - 1.0).abs() < 1e-3, "{case}");
                }
            }
        }
    }
}

#[test]
fn smooth_glass_obeys_fresnel_and_snell() {
    let bsdf = Bsdf::dielectric(Frame::from_z(Vec3::Z), Vec3::Z, 1.5);
    assert!(!bsdf.has_smooth_lobes());
    let wo = wo_at(0.6);
    let (mut reflected, mut refracted) = (0.0, 0.0);
    for i in 0..1000 {
        let s = bsdf
            .sample(wo, [(i as f32 + 0.5) / 1000.0, 0.3, 0.7])
            .unwrap();
        assert!(s.is_delta);
        if s.is_transmission {
            refracted += s.specular[0] / 1000.0;
            assert!((s.wi.x + 0.8 / 1.5).abs() < 1e-5);
        } else {
            reflected += s.specular[0] / 1000.0;
            assert!(s.wi.distance(Vec3::new(-wo.x, 0.0, wo.z)) < 1e-5);
        }
    }
    // Fresnel's equations by hand: cos_t = sqrt(1 - 0.64 / 2.25).
    let cos_t = (1.0_f32 - 0.64 / 2.25).sqrt();
    let rs = (0.6 - 1.5 * cos_t) / (0.6 + 1.5 * cos_t);
    let rp = (1.5 * 0.6 - cos_t) / (1.5 * 0.6 + cos_t);
    let fresnel = 0.5 * (rs * rs + rp * rp);
    assert!((reflected - fresnel).abs() < 1e-3, "{reflected} {fresnel}");
    assert!((refracted - 1.0 + fresnel).abs() < 2e-3, "{refracted}");
}

#[test]
fn glass_reflects_everything_beyond_the_critical_angle() {
    let bsdf = Bsdf::dielectric(Frame::from_z(Vec3::Z), Vec3::Z, 1.5);
    let wo = -wo_at(0.5);
    for i in 0..50 {
        let s = bsdf.sample(wo, numbers(i)).unwrap();
        assert!(!s.is_transmission && (s.specular[0] - 1.0).abs() < 1e-5);
    }
}

#[test]
fn smooth_metal_is_a_mirror_for_sampling_alone() {
    let bsdf = flat(&metal(0.02));
    assert!(!bsdf.has_smooth_lobes());
    let s = bsdf.sample(wo_at(0.3), [0.5; 3]).unwrap();
    assert!(s.is_delta && s.roughness == 0.0 && s.weight() == Spectrum::ONE);
    assert_eq!(bsdf.eval(wo_at(0.3), s.wi).pdf, 0.0);
    assert!(flat(&metal(0.1)).has_smooth_lobes());
}

#[test]
fn black_surfaces_end_the_path() {
    for bsdf in [lambert(0.0), flat(&Layers::default())] {
        assert!(!bsdf.has_smooth_lobes());
        assert!((0..100).all(|i| bsdf.sample(wo_at(0.5), numbers(i)).is_none()));
    }
}

#[test]
fn shading_normals_leak_no_light() {
    let ng = Vec3::Z;
    for i in 0..400 {
        let ns = (ng + 0.9 * direction(7 * i + 1)).normalize();
        let frame = Frame::from_z(ns);
        for layers in [coated(tinted(0.4), 0.2), tinted(0.0)] {
            for bsdf in [
                Bsdf::layered(frame, ng, &layers),
                Bsdf::lambert(frame, ng, Spectrum::ONE),
            ] {
                let (wo, wi) = (direction(7 * i + 2), direction(7 * i + 3));
                let eval = bsdf.eval(wo, wi);
                if wo.z * wi.z < 0.0 {
                    assert_eq!(eval.total(), Spectrum::BLACK);
                    assert_eq!(eval.pdf, 0.0);
                }
                if let Some(s) = bsdf.sample(wo, numbers(i)) {
                    assert_eq!(s.is_transmission, wo.z * s.wi.z < 0.0, "{s:?}");
                }
                assert!(bsdf.albedo(wo).max_channel() <= 1.0 + 2e-3);
            }
        }
    }
}

#[test]
fn bad_directions_and_parameters_give_no_nan() {
    let finite = |bsdf: &Bsdf, wo: Vec3, wi: Vec3, u: [f32; 3]| {
        let eval = bsdf.eval(wo, wi);
        assert!(
            eval.total().is_finite() && eval.pdf.is_finite() && eval.pdf >= 0.0,
            "{bsdf:?} {wo} {wi}: {eval:?}"
        );
        if let Some(s) = bsdf.sample(wo, u) {
            assert!(
                s.weight().is_finite() && s.wi.is_finite() && s.pdf > 0.0,
                "{bsdf:?} {wo}: {s:?}"
            );
        }
    };
    let grazing = Vec3::new(1.0, 0.0, 1e-7);
    let odd = [Vec3::ZERO, Vec3::X, -Vec3::Z, grazing, -grazing, Vec3::NAN];
    let ones = [0.0, 0.5, 1.0 - f32::EPSILON];
    for roughness in ROUGHNESSES.into_iter().chain([-1.0, 3.0]) {
        for (_, layers) in kinds(roughness) {
            let wild = Layers {
                diffuse: Spectrum::splat(7.0),
                ior: 0.0,
                coat: 5.0,
                ..layers
            };
            for bsdf in [flat(&layers), flat(&wild)] {
                for i in 0..60 {
                    let (wo, wi) = (direction(2 * i), direction(2 * i + 1));
                    finite(&bsdf, wo, wi, numbers(i));
                    finite(&bsdf, wo, -wo, numbers(i));
                    let weird = odd[i as usize % odd.len()];
                    finite(&bsdf, wo, weird, numbers(i));
                    let u = [
                        ones[i as usize % 3],
                        ones[i as usize / 3 % 3],
                        ones[i as usize / 9 % 3],
                    ];
                    finite(&bsdf, grazing, wi, u);
                    finite(&bsdf, wo, wi, u);
                }
            }
        }
    }
}
