//! Maps and queries that nobody means to make.

use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{
    DensityRule, Photon, PhotonClass, PhotonMap, RadianceCache, RadiusRule, SurfaceQuery,
};

use crate::photons::{count, in_cube, photon};

const FAR: SurfaceQuery = SurfaceQuery {
    p: Vec3::splat(1e30),
    n: Vec3::Z,
};
const NAN: SurfaceQuery = SurfaceQuery {
    p: Vec3::NAN,
    n: Vec3::NAN,
};
const INFINITE: SurfaceQuery = SurfaceQuery {
    p: Vec3::NEG_INFINITY,
    n: Vec3::Z,
};

#[test]
fn broken_photons_are_counted_and_left_out() {
    let good = photon(0, Vec3::ZERO, Vec3::Z);
    let broken = [
        Photon {
            p: Vec3::new(0.0, f32::NAN, 0.0),
            ..good
        },
        Photon {
            p: Vec3::new(f32::INFINITY, 0.0, 0.0),
            ..good
        },
        Photon {
            p: Vec3::new(0.0, 0.0, 1e19),
            ..good
        },
        Photon {
            power: Spectrum::new(1.0, f32::NAN, 1.0),
            ..good
        },
        Photon {
            power: Spectrum::new(1.0, 1.0, f32::INFINITY),
            ..good
        },
        Photon {
            power: Spectrum::new(-1e-9, 1.0, 1.0),
            ..good
        },
        Photon {
            wi: Vec3::ZERO,
            ..good
        },
        Photon {
            wi: Vec3::NAN,
            ..good
        },
        Photon {
            n: Vec3::splat(1.0),
            ..good
        },
        Photon {
            class: PhotonClass::Caustic { d_eye: f32::NAN },
            ..good
        },
        Photon {
            class: PhotonClass::Caustic { d_eye: -1.0 },
            ..good
        },
    ];
    let mut photons = broken.to_vec();
    photons.insert(5, good);
    let map = PhotonMap::build(&photons);
    assert_eq!((map.len(), map.n_rejected()), (1, broken.len()));
    assert_eq!(map.photon(0).p(), Vec3::ZERO);
    assert_eq!(PhotonMap::build(&broken).len(), 0);
}

#[test]
fn maps_of_no_photon_or_one_answer() {
    let rule = DensityRule::default();
    let query = SurfaceQuery {
        p: Vec3::ZERO,
        n: Vec3::Z,
    };
    for n_photons in [0, 1] {
        let map = PhotonMap::build(&vec![photon(0, Vec3::ZERO, Vec3::Z); n_photons]);
        assert_eq!(map.is_empty(), n_photons == 0);
        assert_eq!(
            map.irradiance(&query, 1.0, &rule).n_photons,
            n_photons as u32
        );
        assert_eq!(map.nearest(query.p, count(3), 1.0).len(), n_photons);
        let radius = RadiusRule::Fixed(0.5);
        let cache = RadianceCache::build(&map, count(1), radius, &rule);
        assert_eq!(cache.len(), n_photons);
        assert_eq!(cache.lookup(&query, 1.0).is_some(), n_photons == 1);
    }
}

#[test]
fn a_thousand_photons_at_one_place() {
    let n_photons = 1000;
    let at_one_place = |i| photon(i, Vec3::new(3.0, -2.0, 5.0), Vec3::Z);
    let photons: Vec<Photon> = (0..n_photons).map(at_one_place).collect();
    let map = PhotonMap::build(&photons);
    let query = SurfaceQuery {
        p: photons[0].p,
        n: Vec3::Z,
    };
    let mut n_found = 0;
    map.for_each_within(query.p, 0.0, |_, d_sq| n_found += u32::from(d_sq == 0.0));
    assert_eq!(n_found, n_photons);
    let nearest = map.nearest(query.p, count(10), 1.0);
    let indices: Vec<u32> = nearest.iter().map(|found| found.idx).collect();
    assert_eq!(indices, (0..10).collect::<Vec<u32>>());

    let rule = DensityRule::default();
    let by_radius = map.irradiance(&query, 0.5, &rule);
    assert_eq!(by_radius.n_photons, n_photons);
    // Discs without area.
    for found in [
        map.irradiance(&query, 0.0, &rule),
        map.irradiance_by_nearest(&query, count(10), 1.0, &rule),
    ] {
        assert!(found.n_photons > 0 && found.value.is_black(), "{found:?}");
    }
}

#[test]
fn queries_from_nowhere_find_nothing() {
    let map = PhotonMap::build(&in_cube(100));
    let rule = DensityRule::default();
    for query in [FAR, NAN, INFINITE] {
        for radius in [0.1, 1e20, f32::INFINITY, f32::NAN, -1.0] {
            assert_eq!(map.irradiance(&query, radius, &rule).n_photons, 0);
            assert!(map.nearest(query.p, count(5), radius).is_empty());
        }
    }
    let inside = SurfaceQuery {
        p: Vec3::splat(0.5),
        n: Vec3::Z,
    };
    let found = map.irradiances(&[NAN, inside, INFINITE, FAR], 0.5, &rule);
    let n_photons: Vec<u32> = found.iter().map(|found| found.n_photons).collect();
    let expected = map.irradiance(&inside, 0.5, &rule).n_photons;
    assert!(expected > 0);
    assert_eq!(n_photons, [0, expected, 0, 0]);
}

#[test]
fn maps_are_alike_at_any_scale() {
    let at_scale = |scale: f32| {
        let scaled = |photon: Photon| Photon {
            p: photon.p * scale,
            ..photon
        };
        let photons: Vec<Photon> = in_cube(2000).into_iter().map(scaled).collect();
        let map = PhotonMap::build(&photons);
        let mut found = Vec::new();
        map.for_each_within(Vec3::splat(0.5 * scale), 0.25 * scale, |photon, _| {
            found.push(photon.idx());
        });
        found
    };
    let expected = at_scale(1.0);
    assert!(!expected.is_empty());
    for exponent in [-40, -20, 20, 50] {
        // Powers of two change no digit.
        assert_eq!(at_scale(2.0_f32.powi(exponent)), expected);
    }
}
