//! Look-ups against a search through all photons.

use std::num::NonZeroUsize;

use kilauea_math::{Spectrum, Vec2, Vec3, warp};
use kilauea_photon::{Photon, PhotonClass, PhotonMap};
use kilauea_testing::uniforms;

/// Photons in a cube, of which some share their place.
fn photons(n: u32) -> Vec<Photon> {
    let photon = |i: u32| {
        let [x, y, z] = uniforms(1, if i % 10 == 9 { i - 1 } else { i });
        let [u, v] = uniforms(2, i);
        let n = warp::uniform_sphere(Vec2::new(u, v));
        Photon {
            p: Vec3::new(x, y, z),
            power: Spectrum::ONE,
            wi: n,
            n,
            light_idx: i % 3,
            class: PhotonClass::Global,
            path_idx: i,
            depth: 0,
        }
    };
    (0..n).map(photon).collect()
}

fn queries() -> Vec<(Vec3, f32)> {
    let inside = (0..200).map(|i| {
        let [x, y, z, r] = uniforms(4, i);
        (Vec3::new(x, y, z) * 1.2 - 0.1, r * r)
    });
    inside
        .chain([
            (Vec3::ZERO, 0.0),
            (Vec3::splat(0.5), 2.0),
            (Vec3::splat(-9.0), 1.0),
        ])
        .collect()
}

#[test]
fn radius_search_finds_what_lies_within() {
    for n in [0, 1, 7, 8, 9, 64, 65, 5000] {
        let map = PhotonMap::build(&photons(n));
        assert_eq!(map.len(), n as usize);
        for (p, radius) in queries() {
            let mut found = Vec::new();
            map.for_each_within(p, radius, |photon, d_sq| {
                assert_eq!(photon.p().distance_squared(p), d_sq);
                found.push(photon.idx());
            });
            let expected: Vec<usize> = (0..map.len())
                .filter(|&i| map.photon(i).p().distance_squared(p) <= radius * radius)
                .collect();
            assert_eq!(found, expected, "{n} photons, {radius} around {p}");
        }
    }
}

#[test]
fn nearest_finds_the_nearest() {
    for n in [0, 1, 8, 65, 5000] {
        let map = PhotonMap::build(&photons(n));
        for (p, max_radius) in queries() {
            let mut all: Vec<(f32, u32)> = (0..map.len())
                .map(|i| (map.photon(i).p().distance_squared(p), i as u32))
                .filter(|&(d_sq, _)| d_sq <= max_radius * max_radius)
                .collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for k in [1, 5, 60] {
                let found = map.nearest(p, NonZeroUsize::new(k).expect("not zero"), max_radius);
                let found: Vec<(f32, u32)> = found.iter().map(|f| (f.d_sq, f.idx)).collect();
                assert_eq!(
                    found,
                    all[..k.min(all.len())],
                    "{n} photons, {k} around {p}"
                );
            }
        }
    }
}
