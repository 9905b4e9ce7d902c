//! Partial maps against one map, with equal and unequal shares.

use kilauea_math::Vec3;
use kilauea_photon::partial::{Combination, merged, merged_in_rounds};
use kilauea_photon::{DensityRule, Kernel, Photon, PhotonMap, SurfaceQuery};
use kilauea_testing::{Family, Moments};

use crate::photons::{count, on_square, photon};

/// Photons of a part with the share one.
const N_FULL: u32 = 6000;
const MAX_RADIUS: f32 = 0.3;
const N_SEEDS: u32 = 20;
const N_QUERIES: u32 = 49;

const RULE: DensityRule = DensityRule {
    kernel: Kernel::Constant,
    min_cos_normals: 0.5,
    max_plane_distance: 0.3,
};

/// The photons of each part, on one square.
fn parts(shares: &[f32], seed: u32) -> Vec<Vec<Photon>> {
    let part = |(m, share): (u32, &f32)| on_square(seed * 16 + m, (share * N_FULL as f32) as u32);
    (0..).zip(shares).map(part).collect()
}

/// Places of which the discs lie within the square.
fn queries() -> impl Iterator<Item = SurfaceQuery> {
    (0..N_QUERIES).map(|i| SurfaceQuery {
        p: Vec3::new(
            0.3 + 0.06 * (i % 7) as f32,
            0.3 + 0.06 * (i / 7) as f32,
            0.0,
        ),
        n: Vec3::Z,
    })
}

/// For each combination relative errors, each of the mean over all places with one set of photons.
fn errors(shares: &[f32], combinations: &[Combination]) -> Vec<Moments> {
    let mut errors = vec![Vec::new(); combinations.len()];
    for seed in 1..=N_SEEDS {
        let parts = parts(shares, seed);
        let truth = parts.iter().map(Vec::len).sum::<usize>() as f64;
        let maps: Vec<PhotonMap> = parts.iter().map(|part| PhotonMap::build(part)).collect();
        for (combination, errors) in combinations.iter().zip(&mut errors) {
            let estimate = |query| combination.irradiance(&maps, &query, &RULE).value[0];
            let mean = queries().map(estimate).map(f64::from).sum::<f64>() / f64::from(N_QUERIES);
            errors.push(mean / truth - 1.0);
        }
    }
    errors.iter().map(|errors| Moments::of(errors)).collect()
}

/// Photons of 50 a part.
fn k(shares: &[f32]) -> std::num::NonZeroUsize {
    count(50 * shares.len())
}

#[test]
fn the_published_composition_is_low_where_shares_differ() {
    // Expectations of M² k / Σ Aₘ for areas Aₘ ~ Gamma(k) / λₘ, over Σ λₘ, by 10⁶ draws.
    let mut family = Family::new("published composition");
    for (shares, k, expected) in [
        (&[1.0, 1.0, 1.0, 1.0][..], 64, 0.0159),
        (&[1.0, 1.0, 1.0, 0.5], 200, -0.0806),
        (&[1.0, 1.0, 1.0, 0.1], 200, -0.5981),
        (&[1.0, 0.1], 100, -0.6639),
    ] {
        let combination = Combination::Published {
            k: count(k),
            max_radius: MAX_RADIUS,
        };
        let found = errors(shares, &[combination])[0];
        let case = format!("{shares:?}: {:.4}", found.mean);
        assert!(found.standard_error() < 0.005, "{case}: too few to tell");
        family.add(case, found.p_value(expected, 0.0005));
    }
    family.check();
}

#[test]
fn the_others_are_exact_with_any_shares() {
    let mut family = Family::new("exact combinations");
    for shares in [
        &[1.0, 1.0, 1.0, 1.0][..],
        &[1.0, 1.0, 1.0, 0.5],
        &[1.0, 1.0, 1.0, 0.1],
        &[1.0, 0.01],
    ] {
        let (k, max_radius) = (k(shares), MAX_RADIUS);
        let combinations = [
            Combination::CommonRadius { radius: 0.06 },
            Combination::Merged { k, max_radius },
            Combination::MergedInRounds { k, max_radius },
        ];
        for (combination, found) in combinations.iter().zip(errors(shares, &combinations)) {
            let case = format!("{combination:?} {shares:?}: {:.4}", found.mean);
            assert!(found.standard_error() < 0.01, "{case}: too few to tell");
            family.add(case, found.p_value(0.0, 0.0));
        }
    }
    family.check();
}

#[test]
fn the_exact_ones_give_what_one_map_gives() {
    for shares in [&[1.0, 1.0, 1.0][..], &[1.0, 0.3, 0.05], &[1.0, 0.0]] {
        let parts = parts(shares, 99);
        let maps: Vec<PhotonMap> = parts.iter().map(|part| PhotonMap::build(part)).collect();
        let whole = PhotonMap::build(&parts.concat());
        let k = k(shares);
        for query in queries() {
            let by_nearest = whole.irradiance_by_nearest(&query, k, MAX_RADIUS, &RULE);
            let all_at_once = merged(&maps, &query, k, MAX_RADIUS, &RULE);
            let in_rounds = merged_in_rounds(&maps, &query, k, MAX_RADIUS, &RULE);
            assert_eq!(all_at_once.irradiance, by_nearest);
            assert_eq!(in_rounds.irradiance, by_nearest);

            // Photons of one watt add up without rounding, so only the weight does round.
            let combination = Combination::CommonRadius { radius: 0.06 };
            let found = combination.irradiance(&maps, &query, &RULE);
            let expected = whole.irradiance(&query, 0.06, &RULE);
            assert_eq!(found.n_photons, expected.n_photons);
            let error = (found.value[0] / expected.value[0] - 1.0).abs();
            assert!(error < 1e-4, "{error}");
        }
    }
}

#[test]
fn rounds_send_less_and_ask_again_where_one_part_has_all() {
    let k = count(100);
    let counts = |shares: &[f32]| {
        let parts = parts(shares, 5);
        let maps: Vec<PhotonMap> = parts.iter().map(|part| PhotonMap::build(part)).collect();
        let answers = queries().map(|query| {
            let all_at_once = merged(&maps, &query, k, MAX_RADIUS, &RULE).n_sent;
            let in_rounds = merged_in_rounds(&maps, &query, k, MAX_RADIUS, &RULE);
            (all_at_once, in_rounds.n_sent, in_rounds.n_asked_again)
        });
        answers.fold((0, 0, 0), |sum, a| (sum.0 + a.0, sum.1 + a.1, sum.2 + a.2))
    };
    let (all_at_once, in_rounds, n_asked_again) = counts(&[1.0; 4]);
    assert!(
        2 * in_rounds < all_at_once,
        "{in_rounds} of {all_at_once} photons"
    );
    assert!(n_asked_again < N_QUERIES as usize / 10, "{n_asked_again}");
    let (.., n_asked_again) = counts(&[1.0, 0.02, 0.02, 0.02]);
    assert_eq!(n_asked_again, N_QUERIES as usize, "one part must send all");
}

#[test]
fn parts_without_photons_are_black() {
    let query = SurfaceQuery {
        p: Vec3::ZERO,
        n: Vec3::Z,
    };
    let (k, max_radius) = (count(4), 1.0);
    let empty = || PhotonMap::build(&[]);
    let one = || PhotonMap::build(&[photon(0, Vec3::ZERO, Vec3::Z)]);
    for combination in [
        Combination::Published { k, max_radius },
        Combination::CommonRadius { radius: max_radius },
        Combination::Merged { k, max_radius },
        Combination::MergedInRounds { k, max_radius },
    ] {
        for (maps, n_photons) in [
            (vec![], 0),
            (vec![empty(), empty()], 0),
            (vec![empty(), one()], 1),
        ] {
            let found = combination.irradiance(&maps, &query, &RULE);
            assert_eq!(found.n_photons, n_photons, "{combination:?}");
            assert!(found.value.is_finite());
        }
    }
}
