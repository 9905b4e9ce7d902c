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
fn records_hold_what_the_photons_between_them_say() {
    let map = PhotonMap::build(&on_square(1, 3000));
    let rule = DensityRule::default();
    for every in [2, 4, 7] {
        let cache = RadianceCache::build(&map, count(every), RADIUS, &rule);
        assert_eq!(cache.len(), map.len().div_ceil(every));
        for i in (0..map.len()).step_by(every) {
            let photon = map.photon(i);
            let query = SurfaceQuery {
                p: photon.p(),
                n: photon.n(),
            };
            let mut expected = 0.0;
            map.for_each_within(query.p, 0.05, |other, d_sq| {
                if other.idx() % every != 0 && rule.accepts(&query, other, d_sq) {
                    let share = every as f32 / (every - 1) as f32;
                    expected += share * other.power()[0] * rule.kernel.weight(d_sq, 0.05 * 0.05);
                }
            });
            // None where photons are uneven.
            if let Some(found) = cache.lookup(&query, 0.0) {
                assert!((found.value[0] - expected).abs() <= 1e-4 * expected);
                assert_eq!(found.radius, 0.05);
            }
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

/// Records are where photons are, and know no more of light than other places; those that stand for much
/// of the surface know no less. With its own photon each would be too bright by two of twenty, and with
/// those of others the mean over the surface would be too dark by some hundredths.
#[test]
fn the_mean_over_a_surface_is_the_irradiance() {
    let n_photons = 100_000;
    let map = PhotonMap::build(&on_square(3, n_photons));
    let radius = RadiusRule::Nearest {
        k: count(20),
        max_radius: 1.0,
    };
    let cache = RadianceCache::build(&map, count(4), radius, &DensityRule::default());
    // Away from edges, where photons are missing.
    let inner = |i: u32| 0.1 + 0.8 * (i as f32 + 0.5) / 200.0;
    let places = (0..40_000).map(|i| facing_up(inner(i % 200), inner(i / 200)));
    let found: Vec<f32> = places
        .filter_map(|query| Some(cache.lookup(&query, 1.0)?.value[0]))
        .collect();
    let mean = found.iter().sum::<f32>() / found.len() as f32;
    // The standard deviation is 0.006.
    assert!((mean / n_photons as f32 - 1.0).abs() < 0.015, "{mean}");
}
