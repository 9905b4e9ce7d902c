use super::*;
use crate::primitive::bezier::Components;
use crate::primitive::bezier::tests::Random;
use crate::primitive::oracle::Case;
use crate::primitive::round;

fn ends(curve: &Components<4>) -> Ends {
    curve.map(|[first, .., last]| [first, last])
}

/// The same segment as a cubic curve.
fn elevated(ends: &Ends) -> Components<4> {
    ends.map(|c| [c[0], at(c, 1.0 / 3.0), at(c, 2.0 / 3.0), c[1]])
}

/// The closed form against the general search.
#[test]
fn round_segments_are_straight_cubics() {
    const N: usize = 100_000;
    let mut random = Random(21);
    let (mut n_hits, mut n_grazing) = (0, 0);
    for _ in 0..N {
        let case = Case::new(&mut random);
        let frame = case.frame();
        let segment = ends(&case.curve(&frame));
        let closed = intersect_round(&segment, &frame);
        let searched = round::intersect(&elevated(&segment), [0.0, 1.0], &frame, f64::INFINITY);
        match (closed, searched) {
            (Some(a), Some(b)) => {
                let apart = (a.t - b.t).abs() * case.dir.length();
                assert!(apart < 1e-7 * case.scale, "{apart} at scale {}", case.scale);
                n_hits += 1;
            }
            (None, None) => {}
            _ => n_grazing += 1,
        }
    }
    assert!(n_hits > N / 5, "{n_hits}");
    assert_eq!(n_grazing, 0);
}

#[test]
fn facing_segments_are_hit_where_the_line_passes_within_the_radius() {
    const N: usize = 10_000;
    let mut random = Random(5);
    let mut n_hits = 0;
    for _ in 0..N {
        let case = Case::new(&mut random);
        let frame = case.frame();
        let segment = ends(&case.curve(&frame));
        let [x, y, z, r] = segment;
        let distance = |u: f64| at(x, u).hypot(at(y, u));
        let nearest = (0..=1000)
            .map(|i| f64::from(i) / 1000.0)
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
            .expect("there are samples");
        let length = (x[1] - x[0]).hypot(y[1] - y[0]);
        if length < 1e-9 * case.scale {
            // End-on: all of it is equally near.
            continue;
        }
        // Between samples the distance is lower by the second order only, unless it is small too.
        let slack = 1e-3 * length + 1e-9 * case.scale;
        let found = intersect_facing(&segment, &frame);
        if let Some(place) = found {
            n_hits += 1;
            assert!(distance(nearest) < at(r, nearest) + 2.0 * slack);
            assert!((distance(place.u) - distance(nearest)).abs() < slack);
            let offset = (2.0 * place.v - 1.0).abs() * at(r, place.u);
            assert!((offset - distance(place.u)).abs() < 1e-9 * case.scale);
        } else {
            let is_missed = distance(nearest) < at(r, nearest) - 2.0 * slack;
            assert!(!is_missed || at(z, nearest) <= slack + 1e-3 * (z[1] - z[0]).abs());
        }
    }
    assert!(n_hits > N / 8, "{n_hits}");
}

/// A polyline of segments is hit wherever a line passes within the least radius of it.
#[test]
fn joints_have_no_gaps() {
    let mut random = Random(8);
    let frame = |origin, dir| RayFrame::new(origin, dir, 0.0);
    for _ in 0..20_000 {
        let [a, b, c] = [0; 3].map(|_| random.point());
        let radius = 0.01;
        let origin = 5.0 * random.point();
        let ray = frame(origin, b + 0.57 * radius * random.point() - origin);
        let segment = |from: kilauea_math::DVec3, to: kilauea_math::DVec3| {
            let (from, to) = (
                ray.local(from.as_vec3().to_array()),
                ray.local(to.as_vec3().to_array()),
            );
            let [x, y, z] = [0, 1, 2].map(|axis| [from[axis], to[axis]]);
            [x, y, z, [radius; 2]]
        };
        let both = [segment(a, b), segment(b, c)];
        assert!(both.iter().any(|s| intersect_round(s, &ray).is_some()));
        assert!(both.iter().any(|s| intersect_facing(s, &ray).is_some()));
    }
}
