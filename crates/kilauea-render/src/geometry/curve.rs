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

/// A segment of a curve at a moment, in its chunk's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    pub(crate) basis: CurveBasis,
    pub(crate) profile: CurveProfile,
    /// Control points, zero beyond the last, as in the next two.
    pub(crate) controls: [Vec3; 4],
    pub(crate) radii: [f32; 4],
    /// Of an oriented ribbon.
    pub(crate) normals: Option<[Vec3; 4]>,
}

impl Segment {
    pub(super) fn of(chunk: &CurvesChunk, segment: u32, time: f32) -> Self {
        let first = chunk.segments[segment as usize] as usize;
        let range = first..first + chunk.basis.n_points();
        let mut radii = [0.0; 4];
        radii[..chunk.basis.n_points()].copy_from_slice(&chunk.radii[range.clone()]);
        Self {
            basis: chunk.basis,
            profile: chunk.profile,
            controls: control_points(chunk, first, time),
            radii,
            normals: chunk.normals.as_ref().map(|normals| {
                let mut controls = [Vec3::ZERO; 4];
                let slots = controls.iter_mut().zip(&normals[range]);
                slots.for_each(|(slot, n)| *slot = Vec3::from_array(*n));
                controls
            }),
        }
    }

    /// The point at the hit's place along and across.
    pub(super) fn point(&self, transform: &EngineTransform, view: &View) -> ShapePoint {
        let Self {
            controls, radii, ..
        } = self;
        let weights = Weights::at(self.basis, view.uv.x);
        let axis = Weights::sum(&weights.value, controls);
        let along = Weights::sum(&weights.slope, controls);
        let order = self.basis.n_points();
        let radii = weights.value.iter().zip(radii).take(order);
        let radius: f32 = radii.map(|(w, r)| w * r).sum();
        let size = controls.iter().map(|&p| extent(p)).fold(0.0, f32::max) + radius;
        let p_error = gamma(24) * (size + transform.reach());

        let (p, ng, p_error) = match self.profile {
            CurveProfile::Round => {
                let ball = Ball {
                    center: axis,
                    radius,
                };
                let (p, ng, ball_error) = ball.point_and_normal(transform, view);
                (p, ng, p_error.max(ball_error))
            }
            CurveProfile::Ribbon => {
                let normal = self.ribbon_normal(&weights, transform, view);
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
                segment: 0,
                first: 0,
                weights: weights.value,
                slopes: weights.slope,
            },
        }
    }

    /// The normal along an oriented ribbon; toward the ray where there is none.
    fn ribbon_normal(&self, weights: &Weights, transform: &EngineTransform, view: &View) -> Vec3 {
        let Some(normals) = &self.normals else {
            let viewer = transform.point_of_chunk(view.p_ray + view.wo);
            return viewer - transform.point_of_chunk(view.p_ray);
        };
        let normals = weights.value.iter().zip(normals);
        let normals = normals.take(self.basis.n_points());
        normals.map(|(w, n)| *w * *n).sum()
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
