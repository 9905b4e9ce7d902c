//! Irradiance that was computed beforehand.

use kilauea_math::Vec3;
use kilauea_photon::{DensityRule, PhotonMap, RadianceCache, RadiusRule, SurfaceQuery};

use crate::photons::{count, on_square, photon};

const RADIUS: RadiusRule = RadiusRule::Fixed(0.05);

fn facing_up(x: f32, y: f32) -> SurfaceQuery {
    SurfaceQuery {
        p: Vec3::new(x, y, 0.0),
        n: Vec3::Z,
    }
}

#[test]
fn records_hold_what_the_map_says_of_other_photons() {
    let map = PhotonMap::build(&on_square(1, 3000));
    let rule = DensityRule::default();
    for every in [1, 4, 7] {
        let cache = RadianceCache::build(&map, count(every), RADIUS, &rule);
        assert_eq!(cache.len(), map.len().div_ceil(every));
        for i in (0..map.len()).step_by(every) {
            let photon = map.photon(i);
            let query = SurfaceQuery {
                p: photon.p(),
                n: photon.n(),
            };
            let all = map.irradiance_by(&query, RADIUS, &rule).value;
            let own = photon.power() * rule.kernel.weight(0.0, 0.05 * 0.05);
            let found = cache.lookup(&query, 0.0).expect("a record");
            let difference = (found.value - (all - own)).max_channel().abs();
            assert!(difference <= 1e-5 * all.max_channel(), "{difference}");
            assert_eq!(found.radius, 0.05);
        }
    }
}

#[test]
fn lookups_take_the_nearest_record_that_faces_the_same_way() {
    // A thin plate: dense light from above, little from below.
    let above = on_square(1, 4000);
    let below = on_square(2, 40).into_iter().map(|mut photon| {
        photon.path_idx += 4000;
        photon.n = -Vec3::Z;
        photon.wi = -Vec3::Z;
        photon
    });
    let map = PhotonMap::build(&above.into_iter().chain(below).collect::<Vec<_>>());
    let cache = RadianceCache::build(
        &map,
        count(1),
        RadiusRule::Fixed(0.2),
        &DensityRule::default(),
    );
    let up = facing_up(0.5, 0.5);
    let down = SurfaceQuery { n: -Vec3::Z, ..up };
    let irradiance = |query| cache.lookup(query, 1.0).expect("a record").value[0];
    assert!(
        (irradiance(&up) / 4000.0 - 1.0).abs() < 0.15,
        "{}",
        irradiance(&up)
    );
    assert!(irradiance(&down) < 200.0, "{}", irradiance(&down));
}

#[test]
fn lookups_that_find_nothing_are_counted() {
    let map = PhotonMap::build(&[photon(0, Vec3::ZERO, Vec3::Z)]);
    let cache = RadianceCache::build(&map, count(1), RADIUS, &DensityRule::default());
    let sideways = SurfaceQuery {
        p: Vec3::ZERO,
        n: Vec3::X,
    };
    let queries = [
        facing_up(0.0, 0.05),
        facing_up(0.0, 0.2),
        sideways,
        facing_up(0.0, 0.0),
    ];
    let found = cache.lookups(&queries, 0.1);
    let hits: Vec<bool> = found.irradiances.iter().map(Option::is_some).collect();
    assert_eq!(hits, [true, false, false, true]);
    assert_eq!(found.n_missed, 2);
}

/// Records are where photons are, and know no more of light than other places: with what it brought
/// itself, each would be too bright by two of twenty photons.
#[test]
fn the_mean_of_records_is_the_irradiance() {
    let n_photons = 20_000;
    let map = PhotonMap::build(&on_square(3, n_photons));
    let radius = RadiusRule::Nearest {
        k: count(20),
        max_radius: 1.0,
    };
    let cache = RadianceCache::build(&map, count(1), radius, &DensityRule::default());
    // Away from edges, where photons are missing.
    let inner = |i: u32| 0.1 + 0.8 * (i as f32 + 0.5) / 40.0;
    let places = (0..1600).map(|i| facing_up(inner(i % 40), inner(i / 40)));
    let found = places.map(|query| cache.lookup(&query, 1.0).expect("a record").value[0]);
    let mean = found.sum::<f32>() / 1600.0;
    assert!((mean / n_photons as f32 - 1.0).abs() < 0.03, "{mean}");
}
