//! Mirrors among the lobes, as they are told of without a draw.

use kilauea_bsdf::{Bsdf, BsdfSample, Mirror};
use kilauea_math::{Spectrum, Vec3};

use crate::surfaces::{all, coated, flat, plastic, views};

/// What draws say of mirrors, from evenly spaced choices of a lobe.
fn drawn(surface: &Bsdf, wo: Vec3) -> Option<Mirror> {
    const N: u32 = 4096;
    let choices = (0..N).map(|i| (i as f32 + 0.5) / N as f32);
    let draws = choices.filter_map(|u| surface.sample(wo, [u, 0.5, 0.5]));
    let mut found: Option<Mirror> = None;
    for sample in draws.filter(BsdfSample::is_mirrored) {
        let nothing = Mirror {
            wi: sample.wi,
            reflectance: Spectrum::BLACK,
            probability: 0.0,
        };
        let mirror = found.get_or_insert(nothing);
        assert_eq!(mirror.wi, sample.wi);
        mirror.reflectance += sample.weight() / N as f32;
        mirror.probability += 1.0 / N as f32;
    }
    found
}

#[test]
fn mirrors_are_what_is_drawn_of_them() {
    let mut n_mirrors = 0;
    for surface in all() {
        for wo in views() {
            let (told, found) = (
                surface.bsdf.seen_from(wo).mirror(),
                drawn(&surface.bsdf, wo),
            );
            let case = format!("{}, wo {wo}: {told:?}, drawn {found:?}", surface.name());
            assert_eq!(told.is_some(), found.is_some(), "{case}");
            let Some((told, found)) = told.zip(found) else {
                continue;
            };
            n_mirrors += 1;
            assert_eq!(told.wi, found.wi, "{case}");
            assert!(
                (told.probability - found.probability).abs() < 1e-3,
                "{case}"
            );
            let difference = (told.reflectance - found.reflectance).max_channel();
            assert!(difference.abs() < 3e-3, "{case}");
        }
    }
    assert!(n_mirrors > 20, "{n_mirrors}");
}

/// The coat and the interface below it are one mirror.
#[test]
fn mirrors_of_one_surface_add_up() {
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let mirror = |layers| flat(&layers).seen_from(wo).mirror().expect("there is one");
    let [both, coat, interface] = [
        mirror(coated(plastic(0.0), 0.0)),
        mirror(coated(plastic(0.5), 0.0)),
        mirror(plastic(0.0)),
    ];
    assert!(both.reflectance.max_channel() > coat.reflectance.max_channel());
    let of_both = coat.reflectance + interface.reflectance * (Spectrum::ONE - coat.reflectance);
    assert!((both.reflectance - of_both).max_channel().abs() < 1e-3);
}
