//! Look-ups against a search through all photons.

use kilauea_math::Vec3;
use kilauea_photon::PhotonMap;
use kilauea_testing::uniforms;

use crate::photons::{count, in_cube};

/// Places and radii.
fn queries() -> Vec<(Vec3, f32)> {
    let inside = (0..200).map(|i| {
        let [x, y, z, r] = uniforms(4, i);
        (Vec3::new(x, y, z) * 1.2 - 0.1, r * r)
    });
    let others = [
        (Vec3::ZERO, 0.0),
        (Vec3::splat(0.5), 2.0),
        (Vec3::splat(-9.0), 1.0),
        (Vec3::splat(0.5), f32::INFINITY),
    ];
    inside.chain(others).collect()
}

#[test]
fn radius_search_finds_what_lies_within() {
    for n in [0, 1, 7, 8, 9, 64, 65, 5000] {
        let map = PhotonMap::build(&in_cube(n));
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
        let map = PhotonMap::build(&in_cube(n));
        for (p, max_radius) in queries() {
            let mut all: Vec<(f32, u32)> = (0..map.len())
                .map(|i| (map.photon(i).p().distance_squared(p), i as u32))
                .filter(|&(d_sq, _)| d_sq <= max_radius * max_radius)
                .collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for k in [1, 5, 60] {
                let found = map.nearest(p, count(k), max_radius);
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
