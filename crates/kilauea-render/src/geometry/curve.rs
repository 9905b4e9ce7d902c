use kilauea_math::{Vec2, Vec3, gamma};
use kilauea_scene::{CurveBasis, CurveProfile, CurvesChunk};
use kilauea_shading::Element;

use super::interaction::View;
use super::keys::{between, key_before};
use super::placed::EngineTransform;
use super::shape_point::{ShapePoint, extent};
use super::sphere::Ball;

/// How much of each control point a place along a segment has.
#[derive(Clone, Copy, Debug)]
struct Weights {
    value: [f32; 4],
    slope: [f32; 4],
}

impl Weights {
    fn at(basis: CurveBasis, u: f32) -> Self {
        let s = 1.0 - u;
        match basis {
            CurveBasis::Linear => Self {
                value: [s, u, 0.0, 0.0],
                slope: [-1.0, 1.0, 0.0, 0.0],
            },
            // Bernstein polynomials of degree three and their derivatives.
            CurveBasis::Bezier => Self {
                value: [s * s * s, 3.0 * s * s * u, 3.0 * s * u * u, u * u * u],
                slope: [
                    -3.0 * s * s,
                    3.0 * s * (s - 2.0 * u),
                    3.0 * u * (2.0 * s - u),
                    3.0 * u * u,
                ],
            },
        }
    }

    fn sum(weights: &[f32; 4], points: &[Vec3; 4]) -> Vec3 {
        weights.iter().zip(points).map(|(w, p)| *w * *p).sum()
    }
}

/// The point of a curve at the hit's place along and across a segment.
pub(super) fn curve_point(
    chunk: &CurvesChunk,
    segment: u32,
    transform: &EngineTransform,
    view: &View,
) -> ShapePoint {
    let first = chunk.segments[segment as usize] as usize;
    let order = chunk.basis.n_points();
    let controls = control_points(chunk, first, view.time);
    let weights = Weights::at(chunk.basis, view.uv.x);
    let axis = Weights::sum(&weights.value, &controls);
    let along = Weights::sum(&weights.slope, &controls);
    let radii = weights.value.iter().zip(&chunk.radii[first..first + order]);
    let radius: f32 = radii.map(|(w, r)| w * r).sum();
    let size = controls.iter().map(|&p| extent(p)).fold(0.0, f32::max) + radius;
    let p_error = gamma(24) * (size + transform.reach());

    let (p, ng, p_error) = match chunk.profile {
        CurveProfile::Round => {
            let ball = Ball {
                center: axis,
                radius,
            };
            let (p, ng, ball_error) = ball.point(transform, view);
            (p, ng, p_error.max(ball_error))
        }
        CurveProfile::Ribbon => {
            let normal = ribbon_normal(chunk, first, &weights, transform, view);
            let across = normal.cross(along).normalize_or_zero();
            let p = axis + (2.0 * view.uv.y - 1.0) * radius * across;
            let ng = transform.normal(along.cross(across)).normalize_or(view.wo);
            (
                transform.point(p),
                ng,
                p_error.max(gamma(24) * extent(transform.point(p))),
            )
        }
    };
    let dp_du = transform.vector(along);
    ShapePoint {
        p,
        p_error: Vec3::splat(p_error),
        ng,
        ns: ng,
        corners: [
            p,
            p + dp_du,
            p + radius * ng.cross(dp_du).normalize_or_zero(),
        ],
        barycentrics: Vec2::ZERO,
        element: Element::Segment {
            segment,
            first: first as u32,
            weights: weights.value,
            slopes: weights.slope,
        },
    }
}

/// The control points of a segment at a time; zero beyond the last.
fn control_points(chunk: &CurvesChunk, first: usize, time: f32) -> [Vec3; 4] {
    let range = first..first + chunk.basis.n_points();
    let mut controls = [Vec3::ZERO; 4];
    if chunk.later_points.is_empty() {
        let points = &chunk.points[range];
        let slots = controls.iter_mut().zip(points);
        slots.for_each(|(slot, p)| *slot = Vec3::from_array(*p));
        return controls;
    }
    let (before, share) = key_before(chunk.later_points.len() + 1, time);
    let key = |k: usize| match k {
        0 => &chunk.points[range.clone()],
        k => &chunk.later_points[k - 1][range.clone()],
    };
    let keys = key(before).iter().zip(key(before + 1));
    let slots = controls.iter_mut().zip(keys);
    slots.for_each(|(slot, (a, b))| *slot = between(*a, *b, share));
    controls
}

/// The normal along an oriented ribbon; toward the ray where there is none.
fn ribbon_normal(
    chunk: &CurvesChunk,
    first: usize,
    weights: &Weights,
    transform: &EngineTransform,
    view: &View,
) -> Vec3 {
    let Some(normals) = &chunk.normals else {
        let viewer = transform.point_of_chunk(view.p_ray + view.wo);
        return viewer - transform.point_of_chunk(view.p_ray);
    };
    let range = first..first + chunk.basis.n_points();
    let normals = weights.value.iter().zip(&normals[range]);
    normals.map(|(w, n)| *w * Vec3::from_array(*n)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_the_derivatives_of_the_weights() {
        for basis in [CurveBasis::Linear, CurveBasis::Bezier] {
            for u in [0.125, 0.5, 0.75] {
                let weights = Weights::at(basis, u);
                assert!((weights.value.iter().sum::<f32>() - 1.0).abs() < 1e-6);
                let (low, high) = (Weights::at(basis, u - 1e-2), Weights::at(basis, u + 1e-2));
                for i in 0..4 {
                    let secant = (high.value[i] - low.value[i]) / 2e-2;
                    assert!(
                        (secant - weights.slope[i]).abs() < 1e-3,
                        "{basis:?} {u} {i}"
                    );
                }
            }
        }
    }
}
