use super::*;
use crate::primitive::bernstein::value;
use crate::primitive::bezier::tests::Random;
use crate::primitive::oracle::Case;
use kilauea_math::DVec3;

/// The depth of the first hit by sampling: where the line changes sides of the endless ribbon
/// between samples, the place is found by bisection. Places within `border` of an edge, where
/// rounding decides, do not count as hits; nor do those where the curve stops to turn back, past
/// which it is the ribbon that changes sides.
fn first_crossing(
    point: impl Fn(f64) -> DVec3,
    across: impl Fn(f64) -> DVec3,
    radius: impl Fn(f64) -> f64,
    border: f64,
) -> Option<f64> {
    const N: usize = 1000;
    let side = |u: f64| point(u).cross(across(u)).z;
    let mut first: Option<f64> = None;
    for i in 0..N {
        let (mut low, mut high) = (i as f64 / N as f64, (i + 1) as f64 / N as f64);
        if (side(low) > 0.0) == (side(high) > 0.0) {
            continue;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if (side(low) > 0.0) == (side(middle) > 0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        let (c, b) = (point(low), across(low).normalize());
        let offset = -c.truncate().dot(b.truncate()) / b.truncate().length_squared();
        let depth = c.z + offset * b.z;
        let is_turn = side(low).abs() > border * across(low).length();
        if !is_turn && offset.abs() < radius(low) - border && depth > 0.0 {
            first = Some(first.map_or(depth, |first| first.min(depth)));
        }
    }
    first
}

/// Whether rounding alone says how a ribbon turns: a straight curve that goes there and back, or one
/// seen end-on.
fn is_unclear(case: &Case, [x, y, ..]: &Components<4>) -> bool {
    let seen = [x, y].map(|c| span(c).1 - span(c).0);
    case.is_fold || f64::max(seen[0], seen[1]) < 1e-4 * case.scale
}

fn check(is_oriented: bool, seed: u32) {
    const N: usize = 3000;
    let mut random = Random(seed);
    let (mut n_hits, mut n_earlier) = (0, 0);
    for _ in 0..N {
        let case = Case::new(&mut random);
        let frame = case.frame();
        let curve = case.curve(&frame);
        if is_unclear(&case, &curve) {
            continue;
        }
        let [x, y, z, r] = curve;
        let normals: [[f64; 3]; 4] =
            std::array::from_fn(|_| frame.local_dir(random.point().as_vec3().to_array()));
        let [nx, ny, nz] = [0, 1, 2].map(|axis| normals.map(|n| n[axis]));
        let found = if is_oriented {
            let curve = [x, y, z, r, nx, ny, nz];
            intersect_oriented(&curve, [0.0, 1.0], &frame, f64::INFINITY)
        } else {
            intersect_facing(&curve, [0.0, 1.0], &frame, f64::INFINITY)
        };
        let vector = |c: [[f64; 4]; 3], u: f64| DVec3::from_array(c.map(|c| value(c, u)));
        let point = |u: f64| vector([x, y, z], u);
        let tangent = |u: f64| DVec3::from_array([x, y, z].map(|c| evaluate(&c, u)[1]));
        let across = |u: f64| {
            let normal = if is_oriented {
                vector([nx, ny, nz], u)
            } else {
                DVec3::NEG_Z
            };
            normal.cross(tangent(u))
        };
        let rounding = 1e-7 * case.scale;
        if let Some(place) = found {
            n_hits += 1;
            let (depth, offset) = (place.t * case.dir.length(), 2.0 * place.v - 1.0);
            let b = across(place.u).normalize();
            let on_ribbon = point(place.u) + offset * value(r, place.u) * b;
            let at_end = place.u == 0.0 || place.u == 1.0;
            let slack = value(r, place.u) * if at_end { END_SLACK } else { ROOT_SLACK };
            let off = on_ribbon.distance(DVec3::new(0.0, 0.0, depth));
            assert!(
                off < slack + 1e-9 * case.scale,
                "{off} at scale {}",
                case.scale
            );
            assert!((0.0..=1.0).contains(&place.v));
        }
        if let Some(sampled) = first_crossing(point, across, |u| value(r, u), rounding) {
            let place = found.unwrap_or_else(|| panic!("missed a hit at {sampled}"));
            let later = place.t * case.dir.length() - sampled;
            assert!(later < rounding, "{later} later at scale {}", case.scale);
            n_earlier += usize::from(later < -1e-3 * case.scale);
        } else {
            n_earlier += usize::from(found.is_some());
        }
    }
    assert!(n_hits > N / 8, "{n_hits}");
    // Turns between two samples, and places near an edge.
    assert!(n_earlier < N / 100, "{n_earlier}");
}

#[test]
fn facing_ribbons_agree_with_sampled_ones() {
    check(false, 2);
}

#[test]
fn oriented_ribbons_agree_with_sampled_ones() {
    check(true, 4);
}

/// The nearest hit of eight pieces is that of the whole ribbon, also through symmetrical places
/// where polynomials are zero exactly.
#[test]
fn pieces_leave_no_gaps() {
    let mut random = Random(11);
    let (mut n_hits, mut n_apart) = (0, 0);
    let mut check = |curve: &Components<4>, frame: &RayFrame| {
        let whole = intersect_facing(curve, [0.0, 1.0], frame, f64::INFINITY);
        let of_pieces = (0..8)
            .filter_map(|i| {
                let range = [f64::from(i) / 8.0, f64::from(i + 1) / 8.0];
                intersect_facing(curve, range, frame, f64::INFINITY)
            })
            .min_by(|a, b| a.t.total_cmp(&b.t));
        let agree = match (whole, of_pieces) {
            (Some(a), Some(b)) => (a.t - b.t).abs() < 1e-7 * a.t,
            (a, b) => a == b,
        };
        n_hits += usize::from(whole.is_some());
        n_apart += usize::from(!agree);
    };
    for _ in 0..20_000 {
        let case = Case::new(&mut random);
        let frame = case.frame();
        let curve = case.curve(&frame);
        if !is_unclear(&case, &curve) {
            check(&curve, &frame);
        }
    }
    for i in 0..=64 {
        let x = f64::from(i) / 64.0 - 0.5;
        let frame = RayFrame::new(DVec3::new(x, 0.0, 3.0), DVec3::NEG_Z, 0.0);
        let points = [-0.5, -1.0 / 6.0, 1.0 / 6.0, 0.5].map(|x| frame.local([x, 0.0, 0.0]));
        let [x, y, z] = [0, 1, 2].map(|axis| points.map(|p| p[axis]));
        check(&[x, y, z, [0.01; 4]], &frame);
    }
    assert!(n_hits > 5000, "{n_hits}");
    assert_eq!(n_apart, 0);
}

/// Two curves that share an end and a tangent leave no gap between them.
#[test]
fn smooth_joints_have_no_gaps() {
    let mut random = Random(9);
    for _ in 0..20_000 {
        let [a, b, tangent, c, d] = [0; 5].map(|_| random.point());
        let joint = random.point();
        let first = [a, b, joint - 0.3 * tangent, joint].map(|p| p.as_vec3().to_array());
        let second = [joint, joint + 0.2 * tangent, c, d].map(|p| p.as_vec3().to_array());
        let radius = 0.02;
        let view = random.point().normalize();
        let aside = view.cross(tangent).normalize();
        let target = joint + 0.9 * radius * (2.0 * random.unit() - 1.0) * aside;
        let frame = RayFrame::new(target - 4.0 * view, view, 0.0);
        let is_hit = [first, second].iter().any(|points| {
            let local = points.map(|p| frame.local(p));
            let [x, y, z] = [0, 1, 2].map(|axis| local.map(|p| p[axis]));
            let curve = [x, y, z, [radius; 4]];
            intersect_facing(&curve, [0.0, 1.0], &frame, f64::INFINITY).is_some()
        });
        assert!(is_hit);
    }
}
