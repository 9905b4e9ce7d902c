//! Control points of segments as weighted sums of a curve's points.

use crate::tokens::{CubicBasis, CurveType, CurveWrap};

const THIRD: f32 = 1.0 / 3.0;
const SIXTH: f32 = 1.0 / 6.0;

/// A control point: up to four points of the source, and how much of each.
///
/// A pinned curve takes from points beyond its ends, which are the ends mirrored: these are
/// weighted sums too (P₋₁ = 2 P₀ − P₁), so that no such point is ever made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stencil {
    pub(super) sources: [u32; 4],
    pub(super) weights: [f32; 4],
}

impl Stencil {
    /// One element as it is.
    pub(super) fn alone(element: u32) -> Self {
        Self {
            sources: [element; 4],
            weights: [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// Elements and weights.
    pub(super) fn terms(&self) -> impl Iterator<Item = (u32, f32)> {
        let all = self.sources.into_iter().zip(self.weights);
        all.filter(|(_, weight)| *weight != 0.0)
    }
}

/// How a curve's points, and the values given at its segments' ends, become control points.
#[derive(Clone, Debug, Default)]
pub(super) struct CurveStencils {
    /// Control points, from values per point.
    pub(super) vertex: Vec<Stencil>,
    /// Control points, from values per end of a segment, linear along each segment.
    pub(super) varying: Vec<Stencil>,
}

/// Which curves a prim has.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurveKind {
    pub(super) curve_type: CurveType,
    pub(super) basis: CubicBasis,
    pub(super) wrap: CurveWrap,
}

impl CurveKind {
    /// Segments of a curve of `n` points; none where the number does not fit (UsdGeomBasisCurves).
    pub(super) fn n_segments(self, n: usize) -> Option<usize> {
        let is_periodic = self.wrap == CurveWrap::Periodic;
        match (self.curve_type, self.basis) {
            (CurveType::Linear, _) if is_periodic => (n >= 3).then_some(n),
            (CurveType::Linear, _) => (n >= 2).then(|| n - 1),
            (CurveType::Cubic, CubicBasis::Bezier) if is_periodic => {
                (n >= 3 && n.is_multiple_of(3)).then_some(n / 3)
            }
            (CurveType::Cubic, CubicBasis::Bezier) => (n >= 4 && n % 3 == 1).then_some(n / 3),
            (CurveType::Cubic, _) => match self.wrap {
                CurveWrap::Periodic => (n >= 3).then_some(n),
                CurveWrap::Pinned => (n >= 2).then(|| n - 1),
                CurveWrap::Nonperiodic => (n >= 4).then(|| n - 3),
            },
        }
    }

    /// Values that a `varying` primvar has on a curve.
    pub(super) fn n_varying(self, n_segments: usize) -> usize {
        match self.wrap {
            CurveWrap::Periodic => n_segments,
            CurveWrap::Nonperiodic | CurveWrap::Pinned => n_segments + 1,
        }
    }

    /// Control points of one segment.
    fn order(self) -> usize {
        match self.curve_type {
            CurveType::Linear => 2,
            CurveType::Cubic => 4,
        }
    }

    /// The stencils of a curve whose points and varying values begin where told.
    pub(super) fn stencils(self, n: usize, first_point: u32, first_varying: u32) -> CurveStencils {
        let n_segments = self.n_segments(n).unwrap_or(0);
        let n_varying = self.n_varying(n_segments);
        let order = self.order();
        let mut stencils = CurveStencils::default();
        for segment in 0..n_segments {
            // A segment begins with the last control point of the one before.
            for k in usize::from(segment > 0)..order {
                let weights = self.weights(segment, k);
                stencils
                    .vertex
                    .push(in_curve(&weights, n, self.wrap, first_point));
                let t = k as f32 / (order - 1) as f32;
                let end = |i: usize| first_varying + (i % n_varying) as u32;
                stencils.varying.push(Stencil {
                    sources: [end(segment), end(segment + 1), 0, 0],
                    weights: [1.0 - t, t, 0.0, 0.0],
                });
            }
        }
        stencils
    }

    /// Control point `k` of a segment: indices in the curve, which may lie outside of it, and
    /// weights.
    fn weights(self, segment: usize, k: usize) -> [(isize, f32); 3] {
        let s = segment as isize;
        // Where the basis has its four points: a pinned curve has one more before its first.
        let p = match self.wrap {
            CurveWrap::Pinned => s - 1,
            CurveWrap::Nonperiodic | CurveWrap::Periodic => s,
        };
        let alone = |i: isize| [(i, 1.0), (i, 0.0), (i, 0.0)];
        match (self.curve_type, self.basis, k) {
            (CurveType::Linear, ..) => alone(s + k as isize),
            (CurveType::Cubic, CubicBasis::Bezier, _) => alone(3 * s + k as isize),
            (CurveType::Cubic, CubicBasis::Bspline, 0) => {
                [(p, SIXTH), (p + 1, 4.0 * SIXTH), (p + 2, SIXTH)]
            }
            (CurveType::Cubic, CubicBasis::Bspline, 1) => {
                [(p + 1, 2.0 * THIRD), (p + 2, THIRD), (p + 2, 0.0)]
            }
            (CurveType::Cubic, CubicBasis::Bspline, 2) => {
                [(p + 1, THIRD), (p + 2, 2.0 * THIRD), (p + 2, 0.0)]
            }
            (CurveType::Cubic, CubicBasis::Bspline, _) => {
                [(p + 1, SIXTH), (p + 2, 4.0 * SIXTH), (p + 3, SIXTH)]
            }
            (CurveType::Cubic, CubicBasis::CatmullRom, 0) => alone(p + 1),
            (CurveType::Cubic, CubicBasis::CatmullRom, 1) => {
                [(p + 1, 1.0), (p + 2, SIXTH), (p, -SIXTH)]
            }
            (CurveType::Cubic, CubicBasis::CatmullRom, 2) => {
                [(p + 2, 1.0), (p + 1, SIXTH), (p + 3, -SIXTH)]
            }
            (CurveType::Cubic, CubicBasis::CatmullRom, _) => alone(p + 2),
        }
    }
}

/// Replaces points beyond the curve by those that they come from.
fn in_curve(weights: &[(isize, f32); 3], n: usize, wrap: CurveWrap, first: u32) -> Stencil {
    let mut stencil = Stencil {
        sources: [first; 4],
        weights: [0.0; 4],
    };
    let mut n_used = 0;
    let mut add = |i: isize, weight: f32| {
        let source = first + i as u32;
        let known = (0..n_used).find(|&j| stencil.sources[j] == source);
        let slot = known.unwrap_or_else(|| {
            n_used += 1;
            n_used - 1
        });
        stencil.sources[slot] = source;
        stencil.weights[slot] += weight;
    };
    let n = n as isize;
    for &(i, weight) in weights.iter().filter(|(_, weight)| *weight != 0.0) {
        if wrap == CurveWrap::Periodic {
            add(i.rem_euclid(n), weight);
        } else if i < 0 {
            add(0, 2.0 * weight);
            add(1, -weight);
        } else if i >= n {
            add(n - 1, 2.0 * weight);
            add(n - 2, -weight);
        } else {
            add(i, weight);
        }
    }
    stencil
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(basis: &str, wrap: &str) -> CurveKind {
        let (curve_type, basis) = match basis {
            "linear" => ("linear", "bezier"),
            basis => ("cubic", basis),
        };
        CurveKind {
            curve_type: curve_type.parse().unwrap(),
            basis: basis.parse().unwrap(),
            wrap: wrap.parse().unwrap(),
        }
    }

    fn apply(stencils: &[Stencil], values: &[f32]) -> Vec<f32> {
        let sum = |s: &Stencil| s.terms().map(|(i, w)| w * values[i as usize]).sum();
        stencils.iter().map(sum).collect()
    }

    /// Value and slope of a Bézier segment.
    fn bezier(b: &[f32], t: f32) -> (f32, f32) {
        let s = 1.0 - t;
        let value =
            s * s * s * b[0] + 3.0 * s * s * t * b[1] + 3.0 * s * t * t * b[2] + t * t * t * b[3];
        let slope =
            3.0 * (s * s * (b[1] - b[0]) + 2.0 * s * t * (b[2] - b[1]) + t * t * (b[3] - b[2]));
        (value, slope)
    }

    #[test]
    fn segments_are_counted_as_in_usd() {
        for (basis, wrap, n, n_segments) in [
            ("linear", "nonperiodic", 5, Some(4)),
            ("linear", "periodic", 5, Some(5)),
            ("linear", "pinned", 5, Some(4)),
            ("linear", "nonperiodic", 1, None),
            ("bezier", "nonperiodic", 7, Some(2)),
            ("bezier", "nonperiodic", 6, None),
            ("bezier", "periodic", 6, Some(2)),
            ("bezier", "pinned", 7, Some(2)),
            ("bspline", "nonperiodic", 6, Some(3)),
            ("bspline", "nonperiodic", 3, None),
            ("bspline", "periodic", 6, Some(6)),
            ("bspline", "pinned", 6, Some(5)),
            ("catmullRom", "pinned", 2, Some(1)),
        ] {
            assert_eq!(
                kind(basis, wrap).n_segments(n),
                n_segments,
                "{basis} {wrap} {n}"
            );
        }
    }

    #[test]
    fn bezier_control_points_give_the_spline() {
        let values = [1.0, 4.0, 2.0, 8.0, 5.0];
        for (basis, at_start, slope_at_start) in [
            ("bspline", (1.0 + 16.0 + 2.0) / 6.0, (2.0 - 1.0) / 2.0),
            ("catmullRom", 4.0, (2.0 - 1.0) / 2.0),
        ] {
            let controls = apply(
                &kind(basis, "nonperiodic").stencils(5, 0, 0).vertex,
                &values,
            );
            assert_eq!(controls.len(), 7);
            let (value, slope) = bezier(&controls[0..4], 0.0);
            assert!((value - at_start).abs() < 1e-5 && (slope - slope_at_start).abs() < 1e-5);
            // Smooth from one segment to the next.
            let (end, start) = (bezier(&controls[0..4], 1.0), bezier(&controls[3..7], 0.0));
            assert!((end.0 - start.0).abs() < 1e-5 && (end.1 - start.1).abs() < 1e-5);
        }
    }

    #[test]
    fn pinned_curves_reach_their_ends() {
        for basis in ["bspline", "catmullRom"] {
            for n in [2, 3, 6] {
                let values = &[3.0, 4.0, 2.0, 8.0, 5.0, 7.0][..n];
                let controls = apply(&kind(basis, "pinned").stencils(n, 0, 0).vertex, values);
                assert!((controls[0] - 3.0).abs() < 1e-5);
                assert!((controls[controls.len() - 1] - values[n - 1]).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn periodic_curves_close() {
        let values = [1.0, 4.0, 2.0, 8.0, 5.0, 3.0];
        for basis in ["linear", "bezier", "bspline", "catmullRom"] {
            let stencils = kind(basis, "periodic").stencils(6, 0, 0);
            for (all, values) in [(&stencils.vertex, &values), (&stencils.varying, &values)] {
                let controls = apply(all, values);
                assert!(
                    (controls[0] - controls[controls.len() - 1]).abs() < 1e-5,
                    "{basis}"
                );
            }
        }
    }

    #[test]
    fn varying_values_are_linear_along_each_segment() {
        let stencils = kind("bspline", "pinned").stencils(3, 0, 0);
        let controls = apply(&stencils.varying, &[0.0, 3.0, 9.0]);
        let expected = [0.0, 1.0, 2.0, 3.0, 5.0, 7.0, 9.0];
        assert!(
            controls
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-5)
        );
    }
}
