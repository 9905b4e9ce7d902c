use super::*;
use crate::primitive::bernstein::value;
use crate::primitive::bezier::tests::Random;
use crate::primitive::oracle::{Case, first_boundary};

/// How far the point at `depth` is outside the union of balls: every least sample, refined.
fn distance_outside(curve: &Components<4>, depth: f64) -> f64 {
    const N: usize = 1000;
    let distance = |u: f64| {
        let [x, y, z, r] = curve.map(|c| value(c, u.clamp(0.0, 1.0)));
        (x * x + y * y + (z - depth).powi(2)).sqrt() - r
    };
    let refined = |u: f64| {
        let (mut low, mut high) = (u - 1.0 / N as f64, u + 1.0 / N as f64);
        for _ in 0..60 {
            let third = (high - low) / 3.0;
            if distance(low + third) < distance(high - third) {
                high -= third;
            } else {
                low += third;
            }
        }
        distance(0.5 * (low + high))
    };
    let samples: Vec<f64> = (0..=N).map(|i| distance(i as f64 / N as f64)).collect();
    let is_least = |&i: &usize| {
        samples[i] <= samples[i.saturating_sub(1)] && samples[i] <= samples[(i + 1).min(N)]
    };
    (0..=N)
        .filter(is_least)
        .map(|i| refined(i as f64 / N as f64).min(samples[i]))
        .fold(f64::INFINITY, f64::min)
}

/// Hits lie on the surface to 1e-9 of the curve's size, are not later than those of sampled balls
/// (nor earlier, from inside), and no ray misses what samples hit.
#[test]
fn hits_agree_with_sampled_balls() {
    const N: usize = 1500;
    let mut random = Random(3);
    let (mut n_hits, mut n_between_samples, mut n_inside) = (0, 0, 0);
    for _ in 0..N {
        let case = Case::new(&mut random);
        let frame = case.frame();
        let curve = case.curve(&frame);
        let found = intersect(&curve, [0.0, 1.0], &frame, f64::INFINITY);
        let sampled = first_boundary(|u| curve.map(|c| value(c, u)), 0.0);
        let Some(place) = found else {
            assert_eq!(sampled, None, "missed what samples hit");
            continue;
        };
        n_hits += 1;
        let depth = place.t * case.dir.length();
        let rounding = 1e-9 * case.scale;
        let off = distance_outside(&curve, depth);
        assert!(off.abs() < rounding, "{off} off at scale {}", case.scale);
        let [x, y, z, r] = curve.map(|c| value(c, place.u));
        let from_axis = (x * x + y * y + (z - depth).powi(2)).sqrt();
        assert!((from_axis - r).abs() < rounding, "not on the ball of u");
        let is_inside = distance_outside(&curve, 0.0) < 0.0;
        n_inside += usize::from(is_inside);
        match sampled {
            Some(sampled) if is_inside => assert!(depth > sampled - rounding),
            Some(sampled) => assert!(depth < sampled + rounding),
            None => n_between_samples += 1,
        }
    }
    assert!(n_hits > N / 4 && n_inside > N / 50, "{n_hits}, {n_inside}");
    assert!(n_between_samples < N / 200, "{n_between_samples}");
}

/// The nearest hit of eight pieces is that of the whole curve.
#[test]
fn pieces_leave_no_gaps() {
    let mut random = Random(11);
    let mut n_hits = 0;
    for _ in 0..20_000 {
        let case = Case::new(&mut random);
        let frame = case.frame();
        let curve = case.curve(&frame);
        let whole = intersect(&curve, [0.0, 1.0], &frame, f64::INFINITY);
        let of_pieces = (0..8)
            .filter_map(|i| {
                let range = [f64::from(i) / 8.0, f64::from(i + 1) / 8.0];
                intersect(&curve, range, &frame, f64::INFINITY)
            })
            .min_by(|a, b| a.t.total_cmp(&b.t));
        match (whole, of_pieces) {
            (Some(a), Some(b)) => {
                let apart = (a.t - b.t).abs() * case.dir.length();
                assert!(apart < 1e-9 * case.scale, "{apart} at scale {}", case.scale);
                n_hits += 1;
            }
            (a, b) => assert_eq!(a, b),
        }
    }
    assert!(n_hits > 5000, "{n_hits}");
}
