//! Where rays meet triangles, in `f64`, and how sure that is.
//!
//! `f64` is exact enough to serve as the truth: its errors are 2⁻²⁹ of those of `f32`. What has to
//! be decided is how much the kernels may be off. They move every corner, as seen from the ray, by
//! a few units in the last place of its distance from the ray's origin, alike for all triangles
//! that share it. So a line that passes a triangle's border within [`BORDER`] such units may be
//! taken for a hit or a miss; one further in must hit, and one further out must miss.

use super::stage::Stage;
use kilauea_accel::{Hit, Ray};
use kilauea_math::{DAffine3, DVec3, Vec3};

/// Width of the border, in units in the last place of the corners' distances.
///
/// Subtraction of the origin, shear and sum round five times in each of two axes, and the edge
/// functions are off as if their corners were moved by two more units of their distance from the
/// line (Woop et al. 2013).
pub(crate) const BORDER: f64 = 12.0;

const UNIT_F64: f64 = f64::EPSILON * 0.5;
const UNIT: f64 = (f32::EPSILON * 0.5) as f64;

/// Width of the border at a distance.
pub(crate) fn border_width(distance: f64) -> f64 {
    BORDER * UNIT * distance
}

/// Placed triangles.
pub(crate) struct Oracle {
    placed: Vec<Placed>,
}

struct Placed {
    world_from_geometry: DAffine3,
    /// `None` where the corners are in engine space.
    geometry_from_world: Option<DAffine3>,
    corners: Vec<[DVec3; 3]>,
    /// Around all corners.
    ball: Ball,
    /// Largest coordinate, in which the ray's origin is rounded where it enters the instance.
    extent: f64,
}

/// A ball with room for the rounding of its making.
struct Ball {
    center: DVec3,
    radius: f64,
}

/// A hit that no rounding explains away.
#[derive(Clone, Copy)]
pub(crate) struct ClearHit {
    pub(crate) t: f64,
    pub(crate) instance: u32,
    pub(crate) triangle: u32,
}

/// What is true of a hit that a kernel reported.
pub(crate) struct Reported {
    /// How far the line passes by the triangle, in units in the last place of its distance; zero
    /// where it passes through.
    pub(crate) off_by: f64,
    /// Whether the line passes through beyond the doubts of `f64`.
    pub(crate) is_inside: bool,
    /// Where the line meets the triangle's plane.
    pub(crate) t: f64,
    /// Where it passes the triangle's first and last corner, less and plus the border.
    pub(crate) t_range: [f64; 2],
    /// By which `t` may be off in `f64` itself.
    pub(crate) uncertain_t: f64,
}

/// A triangle as the ray sees it: the shear takes the ray to the last axis.
struct Seen {
    /// Corners across the ray.
    across: [[f64; 2]; 3],
    /// Corners along the last axis.
    along: [f64; 3],
    /// Twice the signed areas opposite to the corners.
    edges: [f64; 3],
}

struct Shear {
    origin: [f64; 3],
    axes: [usize; 3],
    factors: [f64; 2],
    dir: DVec3,
    dir_largest: f64,
}

impl Oracle {
    pub(crate) fn new(stage: &Stage) -> Self {
        let placed = (0..stage.placements.len()).map(|placement| {
            let n_triangles = stage.mesh(placement).indices.len() as u32;
            let is_baked = stage.may_be_baked(placement);
            let world_from_geometry = stage.placements[placement].world_from_geometry;
            let corners: Vec<[DVec3; 3]> = (0..n_triangles)
                .map(|triangle| {
                    if is_baked {
                        stage.corners(placement, triangle).map(DVec3::as_vec3)
                    } else {
                        stage.mesh(placement).corners(triangle)
                    }
                })
                .map(|corners| corners.map(Vec3::as_dvec3))
                .collect();
            let extent = |p: &DVec3| p.abs().max_element();
            let extent = corners.iter().flatten().map(extent).fold(0.0, f64::max);
            Placed {
                world_from_geometry,
                geometry_from_world: (!is_baked).then(|| world_from_geometry.inverse()),
                ball: Ball::around(&corners),
                corners,
                extent,
            }
        });
        Self {
            placed: placed.collect(),
        }
    }

    /// The nearest hit beyond doubt in the ray's range.
    pub(crate) fn nearest(&self, ray: &Ray) -> Option<ClearHit> {
        let range =
            f64::from(ray.t_min.max(0.0)) * (1.0 + 1e-6)..f64::from(ray.t_max) * (1.0 - 1e-6);
        let mut nearest: Option<ClearHit> = None;
        for (instance, placed) in self.placed.iter().enumerate() {
            let shear = placed.shear(ray);
            if shear.misses(&placed.ball) {
                continue;
            }
            for (triangle, corners) in placed.corners.iter().enumerate() {
                let seen = shear.see(corners);
                if !seen.is_inside() || seen.depth_inside() <= placed.border(&seen) {
                    continue;
                }
                let t = seen.t(shear.dir_largest);
                let is_ahead = t - range.start > shear.uncertain_t(corners);
                if is_ahead && t < nearest.map_or(range.end, |n| n.t) {
                    nearest = Some(ClearHit {
                        t,
                        instance: instance as u32,
                        triangle: triangle as u32,
                    });
                }
            }
        }
        nearest
    }

    /// The truth about a hit.
    pub(crate) fn reported(&self, ray: &Ray, hit: &Hit) -> Reported {
        let placed = &self.placed[hit.instance as usize];
        let shear = placed.shear(ray);
        let corners = &placed.corners[hit.primitive as usize];
        let seen = shear.see(corners);
        let is_sure = seen.depth_inside() > 1e-3 * placed.border(&seen);
        let off_by = if seen.is_inside() {
            0.0
        } else {
            BORDER * seen.distance_outside() / placed.border(&seen)
        };
        Reported {
            off_by,
            is_inside: is_sure && seen.is_inside(),
            t: seen.t(shear.dir_largest),
            t_range: seen.t_range(shear.dir_largest, placed.border(&seen)),
            uncertain_t: shear.uncertain_t(corners),
        }
    }

    /// Whether the way from a point of engine space to one of a placement's own space is free of
    /// the placement's triangles.
    pub(crate) fn is_free(&self, instance: u32, from_world: DVec3, to: DVec3) -> bool {
        let placed = &self.placed[instance as usize];
        let (from, to) = match &placed.geometry_from_world {
            None => (from_world, placed.world_from_geometry.transform_point3(to)),
            Some(m) => (m.transform_point3(from_world), to),
        };
        let shear = Shear::new(from, to - from);
        !placed.corners.iter().any(|corners| {
            let seen = shear.see(corners);
            seen.is_inside() && (0.0..=1.0).contains(&seen.t(shear.dir_largest))
        })
    }

    /// Whether two triangles of an instance are the same, corner by corner.
    pub(crate) fn is_same_place(&self, instance: u32, a: u32, b: u32) -> bool {
        let corners = &self.placed[instance as usize].corners;
        corners[a as usize] == corners[b as usize]
    }
}

impl Ball {
    fn around(corners: &[[DVec3; 3]]) -> Self {
        let points = || corners.iter().flatten();
        let low = points().fold(DVec3::INFINITY, |low, &p| low.min(p));
        let high = points().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
        let center = 0.5 * (low + high);
        let radius = points().fold(0.0, |r: f64, p| r.max(p.distance(center)));
        Self {
            center,
            radius: 1.01 * radius,
        }
    }
}

impl Placed {
    fn shear(&self, ray: &Ray) -> Shear {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        match &self.geometry_from_world {
            None => Shear::new(origin, dir),
            Some(m) => Shear::new(m.transform_point3(origin), m.transform_vector3(dir)),
        }
    }

    /// How far from the border of a triangle the kernels may err.
    fn border(&self, seen: &Seen) -> f64 {
        let distance = if self.geometry_from_world.is_some() {
            // From where the ray enters the instance, and the rounding of that point.
            2.0 * self.extent
        } else {
            let reach = |i: usize| {
                let [x, y] = seen.across[i];
                x.abs().max(y.abs()) + seen.along[i].abs()
            };
            reach(0).max(reach(1)).max(reach(2))
        };
        border_width(distance)
    }
}

impl Shear {
    fn new(origin: DVec3, dir: DVec3) -> Self {
        let size = dir.abs();
        let axes = if size.x > size.y && size.x > size.z {
            [1, 2, 0]
        } else if size.y > size.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let dir_largest = dir[axes[2]];
        Self {
            origin: origin.to_array(),
            axes,
            factors: [dir[axes[0]] / dir_largest, dir[axes[1]] / dir_largest],
            dir,
            dir_largest,
        }
    }

    /// Thin triangles magnify the roundings of `f64`, as in [`kilauea_accel::SurfacePoint`].
    fn uncertain_t(&self, [a, b, c]: &[DVec3; 3]) -> f64 {
        let cross = (b - a).cross(c - a);
        let origin = DVec3::from_array(self.origin);
        let longest = a.distance(*b).max(b.distance(*c)).max(c.distance(*a));
        let reach = longest + a.distance(origin);
        64.0 * UNIT_F64 * longest * longest * reach / cross.dot(self.dir).abs()
    }

    /// Whether the whole line passes a ball by.
    fn misses(&self, ball: &Ball) -> bool {
        let dir = self.dir.normalize();
        let to_center = ball.center - DVec3::from_array(self.origin);
        to_center.cross(dir).length() > ball.radius
    }

    #[inline]
    fn see(&self, corners: &[DVec3; 3]) -> Seen {
        let [kx, ky, kz] = self.axes;
        let see = |p: &DVec3| {
            let along = p[kz] - self.origin[kz];
            let x = (p[kx] - self.origin[kx]) - self.factors[0] * along;
            let y = (p[ky] - self.origin[ky]) - self.factors[1] * along;
            ([x, y], along)
        };
        let [(a, a_along), (b, b_along), (c, c_along)] =
            [see(&corners[0]), see(&corners[1]), see(&corners[2])];
        let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
        Seen {
            across: [a, b, c],
            along: [a_along, b_along, c_along],
            edges: [cross(c, b), cross(a, c), cross(b, a)],
        }
    }
}

impl Seen {
    fn is_inside(&self) -> bool {
        self.edges.iter().all(|&e| e > 0.0) || self.edges.iter().all(|&e| e < 0.0)
    }

    /// Distance of the line from the nearest edge, across the ray.
    fn depth_inside(&self) -> f64 {
        let depth = |i: usize| {
            let (p, q) = (self.across[(i + 1) % 3], self.across[(i + 2) % 3]);
            self.edges[i].abs() / (q[0] - p[0]).hypot(q[1] - p[1])
        };
        depth(0).min(depth(1)).min(depth(2))
    }

    /// Distance of the line from a triangle that it passes by, across the ray.
    fn distance_outside(&self) -> f64 {
        let to_edge = |i: usize| {
            let (p, q) = (self.across[(i + 1) % 3], self.across[(i + 2) % 3]);
            let edge = [q[0] - p[0], q[1] - p[1]];
            let length2 = edge[0] * edge[0] + edge[1] * edge[1];
            let s = -(p[0] * edge[0] + p[1] * edge[1]) / length2;
            let s = if s.is_nan() { 0.0 } else { s.clamp(0.0, 1.0) };
            (p[0] + s * edge[0]).hypot(p[1] + s * edge[1])
        };
        to_edge(0).min(to_edge(1)).min(to_edge(2))
    }

    fn t_range(&self, dir_largest: f64, border: f64) -> [f64; 2] {
        let t = self.along.map(|along| along / dir_largest);
        let border = border / dir_largest.abs();
        [
            t[0].min(t[1]).min(t[2]) - border,
            t[0].max(t[1]).max(t[2]) + border,
        ]
    }

    fn t(&self, dir_largest: f64) -> f64 {
        let sum = self.edges[0] + self.edges[1] + self.edges[2];
        let weighted = |i: usize| self.edges[i] * self.along[i];
        (weighted(0) + weighted(1) + weighted(2)) / (sum * dir_largest)
    }
}
