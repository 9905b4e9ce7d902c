//! What every BSDF must hold, through its public face.

#![forbid(unsafe_code)]

mod statistics;

use kilauea_bsdf::{Bsdf, Layers, f0_from_ior};
use kilauea_math::{Frame, Spectrum, Vec3};
use statistics::{chi2_deviation, direction, sampled_albedo, uniforms};

const COSINES: [f32; 5] = [0.02, 0.1, 0.35, 0.7, 1.0];
const ROUGHNESSES: [f32; 7] = [0.0, 0.04, 0.1, 0.3, 0.5, 0.8, 1.0];

fn wo_at(cos: f32) -> Vec3 {
    Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
}

/// Flat, facing up.
fn layered(layers: &Layers) -> Bsdf {
    Bsdf::layered(Frame::from_z(Vec3::Z), Vec3::Z, layers)
}

fn lambert(albedo: f32) -> Bsdf {
    Bsdf::lambert(Frame::from_z(Vec3::Z), Vec3::Z, Spectrum::splat(albedo))
}

fn plastic(roughness: f32) -> Layers {
    Layers {
        diffuse: Spectrum::ONE,
        f0: Spectrum::splat(f0_from_ior(1.5)),
        f90: Spectrum::ONE,
        roughness,
        ..Layers::default()
    }
}

fn metal(roughness: f32) -> Layers {
    Layers {
        f0: Spectrum::ONE,
        f90: Spectrum::ONE,
        roughness,
        ..Layers::default()
    }
}

fn tinted(roughness: f32) -> Layers {
    Layers {
        diffuse: Spectrum::new(0.1, 0.4, 0.3),
        f0: Spectrum::new(0.6, 0.3, 0.05),
        f90: Spectrum::new(1.0, 0.8, 0.5),
        transmission: 0.3,
        transmission_tint: Spectrum::new(0.9, 0.5, 0.0),
        ..plastic(roughness)
    }
}

fn coated(layers: Layers, coat_roughness: f32) -> Layers {
    Layers {
        coat: 0.8,
        coat_roughness,
        ..layers
    }
}

/// Every kind of surface at one roughness.
fn kinds(roughness: f32) -> [(&'static str, Layers); 6] {
    [
        ("plastic", plastic(roughness)),
        ("metal", metal(roughness)),
        ("tinted", tinted(roughness)),
        ("coated plastic", coated(plastic(roughness), 0.15)),
        ("coated metal", coated(metal(roughness), 0.0)),
        (
            "glass",
            Layers {
                roughness,
                transmission: 1.0,
                ..Layers::default()
            },
        ),
    ]
}

#[test]
fn samples_are_distributed_as_pdf_says() {
    let check = |name: &str, bsdf: &Bsdf, wo: Vec3| {
        let deviation = chi2_deviation(bsdf, bsdf, wo, 40_000);
        assert!(deviation < 4.0, "{name}, wo {wo}: {deviation} sigma");
    };
    check("lambert", &lambert(0.5), wo_at(0.3));
    check("lambert from behind", &lambert(0.5), -wo_at(0.3));
    for roughness in [0.12, 0.4, 1.0] {
        for cos in [0.05, 0.4, 0.95] {
            check(
                &format!("metal {roughness}"),
                &layered(&metal(roughness)),
                wo_at(cos),
            );
        }
        for (name, layers) in kinds(roughness) {
            check(
                &format!("{name} {roughness}"),
                &layered(&layers),
                wo_at(0.6),
            );
        }
    }
}

#[test]
fn a_wrong_pdf_is_noticed() {
    let (sampled, stated) = (layered(&metal(0.4)), layered(&metal(0.43)));
    let deviation = chi2_deviation(&sampled, &stated, wo_at(0.4), 40_000);
    assert!(deviation > 6.0, "{deviation}");
}

#[test]
fn albedo_never_exceeds_one_and_is_what_sampling_finds() {
    for roughness in ROUGHNESSES {
        for (name, layers) in kinds(roughness) {
            for cos in COSINES {
                for wo in [wo_at(cos), -wo_at(cos)] {
                    let bsdf = layered(&layers);
                    let found = sampled_albedo(&bsdf, wo, 4096);
                    let stated = bsdf.albedo(wo);
                    let case = format!("{name} {roughness}, wo {wo}: {found:?}, {stated:?}");
                    assert!(stated.max_channel() <= 1.0 + 1e-3, "{case}");
                    for c in 0..3 {
                        assert!((found[c] - stated[c]).abs() < 5e-3, "{case}");
                    }
                }
            }
        }
    }
}

#[test]
fn white_surfaces_stay_white() {
    for roughness in ROUGHNESSES {
        for (name, layers) in kinds(roughness) {
            if name == "tinted" {
                continue;
            }
            for cos in COSINES {
                for wo in [wo_at(cos), -wo_at(cos)] {
                    let found = sampled_albedo(&layered(&layers), wo, 8192);
                    let error = (found - Spectrum::ONE).to_array().map(f32::abs);
                    assert!(
                        error.iter().all(|&e| e < 5e-3),
                        "{name} {roughness}, wo {wo}: {found:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn weights_are_eval_over_pdf() {
    for roughness in ROUGHNESSES {
        for (name, layers) in kinds(roughness) {
            let bsdf = layered(&layers);
            for i in 0..200 {
                let wo = direction(i);
                let Some(s) = bsdf.sample(wo, uniforms(i)) else {
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

#[test]
fn uncoated_plastic_is_nearly_reciprocal_and_its_diffuse_part_exactly() {
    let bsdf = layered(&plastic(0.5));
    for i in 0..500 {
        let (a, b) = (direction(2 * i).abs(), direction(2 * i + 1).abs());
        if a.z < 0.05 || b.z < 0.05 {
            continue;
        }
        let (there, back) = (bsdf.eval(a, b), bsdf.eval(b, a));
        let check = |there: f32, back: f32, tolerance: f32| {
            assert!(
                (there * a.z - back * b.z).abs() <= tolerance * there * a.z + 1e-6,
                "{there} {back} {a} {b}"
            );
        };
        check(there.diffuse[0], back.diffuse[0], 1e-4);
        check(there.specular[0], back.specular[0], 0.02);
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
        let s = bsdf.sample(wo, uniforms(i)).unwrap();
        assert!(!s.is_transmission && (s.specular[0] - 1.0).abs() < 1e-5);
    }
}

#[test]
fn smooth_metal_is_a_mirror_for_sampling_alone() {
    let bsdf = layered(&metal(0.02));
    assert!(!bsdf.has_smooth_lobes());
    let s = bsdf.sample(wo_at(0.3), [0.5; 3]).unwrap();
    assert!(s.is_delta && s.roughness == 0.0 && s.weight() == Spectrum::ONE);
    assert_eq!(bsdf.eval(wo_at(0.3), s.wi).pdf, 0.0);
    assert!(layered(&metal(0.1)).has_smooth_lobes());
}

#[test]
fn black_surfaces_end_the_path() {
    for bsdf in [lambert(0.0), layered(&Layers::default())] {
        assert!(!bsdf.has_smooth_lobes());
        assert!((0..100).all(|i| bsdf.sample(wo_at(0.5), uniforms(i)).is_none()));
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
                if let Some(s) = bsdf.sample(wo, uniforms(i)) {
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
            for bsdf in [layered(&layers), layered(&wild)] {
                for i in 0..60 {
                    let (wo, wi) = (direction(2 * i), direction(2 * i + 1));
                    finite(&bsdf, wo, wi, uniforms(i));
                    finite(&bsdf, wo, -wo, uniforms(i));
                    let weird = odd[i as usize % odd.len()];
                    finite(&bsdf, wo, weird, uniforms(i));
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
