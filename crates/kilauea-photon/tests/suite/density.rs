//! Irradiance where it is known.

use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{DensityRule, Kernel, Photon, PhotonMap, RadiusRule, SurfaceQuery};
use kilauea_testing::{Family, Moments};

use crate::photons::{count, on_square, photon};

const N_PHOTONS: u32 = 4000;

/// Means over places well within the unit square, one for each map.
fn means(rule: &DensityRule, radius: RadiusRule, seeds: std::ops::Range<u32>) -> Vec<f64> {
    let mean = |seed| {
        let map = PhotonMap::build(&on_square(seed, N_PHOTONS));
        let places = (0..100).map(|i| [0.3 + 0.04 * (i % 10) as f32, 0.3 + 0.04 * (i / 10) as f32]);
        let irradiance = |[x, y]: [f32; 2]| {
            let query = SurfaceQuery {
                p: Vec3::new(x, y, 0.0),
                n: Vec3::Z,
            };
            f64::from(map.irradiance_by(&query, radius, rule).value[0])
        };
        places.map(irradiance).sum::<f64>() / 100.0
    };
    seeds.map(mean).collect()
}

#[test]
fn estimates_expect_to_the_flux_by_area() {
    let mut family = Family::new("irradiance of a square");
    for kernel in [Kernel::Constant, Kernel::Epanechnikov] {
        let rule = DensityRule {
            kernel,
            ..DensityRule::default()
        };
        for (name, radius) in [
            ("fixed", RadiusRule::Fixed(0.05)),
            (
                "2 nearest",
                RadiusRule::Nearest {
                    k: count(2),
                    max_radius: 0.2,
                },
            ),
            (
                "40 nearest",
                RadiusRule::Nearest {
                    k: count(40),
                    max_radius: 0.2,
                },
            ),
            (
                "too few",
                RadiusRule::Nearest {
                    k: count(4000),
                    max_radius: 0.05,
                },
            ),
        ] {
            let moments = Moments::of(&means(&rule, radius, 100..130));
            family.add(
                format!("{kernel:?}, {name}"),
                moments.p_value(f64::from(N_PHOTONS), 0.0),
            );
        }
    }
    family.check();
}

#[test]
fn photons_of_other_surfaces_do_not_count() {
    let query = SurfaceQuery {
        p: Vec3::ZERO,
        n: Vec3::Z,
    };
    let near = Vec3::new(0.01, 0.0, 0.0);
    let above = Vec3::new(0.01, 0.0, 0.01);
    let rule = DensityRule {
        kernel: Kernel::Constant,
        ..DensityRule::default()
    };
    let power_of = |photon: Photon| {
        let map = PhotonMap::build(&[photon]);
        let area = std::f32::consts::PI * 0.1 * 0.1;
        map.irradiance(&query, 0.1, &rule).value * area
    };
    let is_close = |a: Spectrum, b: Spectrum| (a - b).max_channel().abs() < 1e-5;
    assert!(is_close(power_of(photon(0, near, Vec3::Z)), Spectrum::ONE));
    assert!(is_close(
        power_of(photon(0, near, Vec3::new(0.6, 0.0, 0.8))),
        Spectrum::ONE
    ));
    assert_eq!(
        power_of(photon(0, near, Vec3::X)),
        Spectrum::BLACK,
        "the wall beside"
    );
    assert_eq!(
        power_of(photon(0, near, -Vec3::Z)),
        Spectrum::BLACK,
        "the other side"
    );
    assert_eq!(
        power_of(photon(0, above, Vec3::Z)),
        Spectrum::BLACK,
        "a step"
    );
    assert_eq!(
        power_of(photon(0, 100.0 * near, Vec3::Z)),
        Spectrum::BLACK,
        "far away"
    );
}

#[test]
fn packing_keeps_flux_in_expectation() {
    // Many photons of one colour: their rounded powers must add up to it.
    let color = Spectrum::new(0.9, 0.037, 0.211);
    let photons: Vec<Photon> = on_square(9, 50_000)
        .into_iter()
        .map(|photon| Photon {
            power: color,
            ..photon
        })
        .collect();
    let map = PhotonMap::build(&photons);
    let mut family = Family::new("flux of a map");
    for (channel, expected) in color.to_array().into_iter().enumerate() {
        let stored = |i: usize| f64::from(map.photon(i).power()[channel]);
        let values: Vec<f64> = (0..map.len()).map(stored).collect();
        let p_value = Moments::of(&values).p_value(f64::from(expected), 0.0);
        family.add(format!("channel {channel}"), p_value);
    }
    family.check();
}
