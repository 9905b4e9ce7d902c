use crate::Domain;

/// Nodes of Gauss' rule with three points on [0, 1], with their weights.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];
/// Simpson's rule. Its nodes on the rim see an edge that cuts off a corner.
const SIMPSON: [(f64, f64); 3] = [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)];

/// Halvings after which a patch is taken as it is.
const MAX_DEPTH: u32 = 9;

/// Cells along each coordinate of a domain.
const N_CELLS: usize = 24;

/// The integral of `f` over a domain, within a few times `tolerance` in each of its 576 cells.
pub fn integrate_over<D: Domain>(
    domain: &D,
    tolerance: f64,
    mut f: impl FnMut(D::Point) -> f64,
) -> f64 {
    let mut per_area = |at| {
        let (point, measure) = domain.point(at);
        f(point) * measure
    };
    let edge = |i: usize| i as f64 / N_CELLS as f64;
    let cells = (0..N_CELLS * N_CELLS).map(|idx| [idx % N_CELLS, idx / N_CELLS]);
    cells
        .map(|cell| {
            let max = cell.map(|i| edge(i + 1));
            integrate(cell.map(edge), max, tolerance, &mut per_area)
        })
        .sum()
}

/// The integral of `f` ≥ 0 over the rectangle from `min` to `max`, within a few times `tolerance`.
///
/// Gauss' rule and Simpson's, of nine points each, are compared, and the rectangle is quartered
/// where they differ. A peak that falls between all points of a rectangle is missed: start from
/// cells that are not much larger than what may be in them.
pub fn integrate(
    min: [f64; 2],
    max: [f64; 2],
    tolerance: f64,
    f: &mut impl FnMut([f64; 2]) -> f64,
) -> f64 {
    refine(min, max, tolerance, f, 0)
}

fn refine(
    min: [f64; 2],
    max: [f64; 2],
    tolerance: f64,
    f: &mut impl FnMut([f64; 2]) -> f64,
    depth: u32,
) -> f64 {
    let mut range = Range::default();
    let gauss = apply(&GAUSS, min, max, f, &mut range);
    let simpson = apply(&SIMPSON, min, max, f, &mut range);
    // Across a jump the rules may agree by chance.
    let is_smooth = range.min > 0.25 * range.max;
    let most = range.max * (max[0] - min[0]) * (max[1] - min[1]);
    let is_small = most <= 40.0 * tolerance;
    let is_close = (gauss - simpson).abs() <= tolerance;
    // Next to where something is, a corner of it may lie between the nodes.
    let may_hide = range.max == 0.0 && (1..3).contains(&depth);
    if depth == MAX_DEPTH || (is_close && (is_smooth || is_small) && !may_hide) {
        return gauss;
    }
    let [x, y] = [0, 1].map(|axis| 0.5 * (min[axis] + max[axis]));
    // Errors of four quarters are hardly related, so that they add up to twice one of them.
    let mut quarter = |min, max| refine(min, max, 0.5 * tolerance, f, depth + 1);
    quarter(min, [x, y])
        + quarter([x, min[1]], [max[0], y])
        + quarter([min[0], y], [x, max[1]])
        + quarter([x, y], max)
}

/// Of the values at all nodes.
#[derive(Clone, Copy)]
struct Range {
    min: f64,
    max: f64,
}

impl Default for Range {
    fn default() -> Self {
        Self {
            min: f64::INFINITY,
            max: 0.0,
        }
    }
}

/// A product rule.
fn apply(
    nodes: &[(f64, f64); 3],
    min: [f64; 2],
    max: [f64; 2],
    f: &mut impl FnMut([f64; 2]) -> f64,
    range: &mut Range,
) -> f64 {
    let size = [max[0] - min[0], max[1] - min[1]];
    let mut sum = 0.0;
    for &(x, weight_x) in nodes {
        for &(y, weight_y) in nodes {
            let value = f([min[0] + x * size[0], min[1] + y * size[1]]);
            range.min = range.min.min(value);
            range.max = range.max.max(value);
            sum += weight_x * weight_y * value;
        }
    }
    sum * size[0] * size[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_exact() {
        let mut f = |[x, y]: [f64; 2]| x.powi(3) * y * y + 2.0 * y + 5.0 * x.powi(4);
        let found = integrate([1.0, 0.0], [2.0, 3.0], 10.0, &mut f);
        let expected = 15.0 / 4.0 * 9.0 + 9.0 + 31.0 * 3.0;
        assert!((found - expected).abs() < 1e-10, "{found}");
    }

    #[test]
    fn a_disk_in_a_square_has_its_area() {
        let mut f = |[x, y]: [f64; 2]| f64::from(u8::from(x * x + y * y < 1.0));
        // In cells, as both rules may agree by chance on a patch that is much larger than the disk.
        let edge = |i: i32| -1.3 + 0.27 * f64::from(i);
        let cells = (0..100).map(|i| [i % 10, i / 10]);
        let found: f64 = cells
            .map(|cell| integrate(cell.map(edge), cell.map(|i| edge(i + 1)), 1e-4, &mut f))
            .sum();
        assert!((found - std::f64::consts::PI).abs() < 2e-3, "{found}");
    }

    #[test]
    fn a_square_across_cells_has_its_solid_angle() {
        use crate::Directions;
        use kilauea_math::Vec3;
        // A side of a cube, seen from its center in a chart that lies anyhow.
        for axis in [Vec3::Z, Vec3::new(0.3, -0.2, 0.8), Vec3::NEG_X] {
            let is_seen = |w: Vec3| {
                let at = w.truncate() / w.z;
                f64::from(u8::from(w.z > 0.0 && at.abs().max_element() < 1.0))
            };
            let directions = Directions::around(axis, 0.8);
            let found = integrate_over(&directions, 1e-5, is_seen);
            let expected = 4.0 * std::f64::consts::PI / 6.0;
            assert!((found / expected - 1.0).abs() < 1e-4, "{axis}: {found}");
        }
    }

    #[test]
    fn a_narrow_peak_is_resolved() {
        let width = 0.01;
        let mut f = |[x, y]: [f64; 2]| {
            let distance_sq = (x - 0.4).powi(2) + (y - 0.6).powi(2);
            width * width / (width * width + distance_sq).powi(2)
        };
        // ∫ w² / (w² + r²)² over the plane is π; what is outside of a square is less than w² / d².
        let found = integrate([0.0, 0.0], [1.0, 1.0], 1e-5, &mut f);
        assert!((found - std::f64::consts::PI).abs() < 2e-3, "{found}");
    }
}
