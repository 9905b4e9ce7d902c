//! Rect, disk, sphere and cylinder lights: an affine image of a unit shape.
//!
//! Work happens on the unit shape; the cofactor matrix of the affine map carries area vectors, so
//! non-uniform scales and shears are exact: a patch of unit area with unit normal `n` becomes a
//! patch of area `|cof(M) n|`.

use kilauea_accel::Ray;
use kilauea_math::{Bounds3, DAffine3, DMat3, DVec3, Frame, Mat3, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::{Light, LightShape};
use kilauea_texture::TextureStore;
use std::f32::consts::PI;

use super::LightSample;
use super::emission::Emission;
use super::spherical_rect::{Rectangle, SphericalRect};

/// A light with an area that emits from one side.
#[derive(Clone, Debug)]
pub(super) struct AreaLight {
    pub(super) shape: UnitShape,
    pub(super) center: Vec3,
    pub(super) engine_from_unit: Mat3,
    unit_from_engine: Mat3,
    /// Carries outward area vectors from the unit shape to engine space.
    pub(super) cofactor: Mat3,
    /// Radius where the shape is a true sphere.
    sphere_radius: Option<f32>,
    /// A rect that is a true rectangle.
    rectangle: Option<Rectangle>,
    /// What it emits.
    pub emission: Emission,
    /// Whether camera rays see it.
    pub visible_to_camera: bool,
    /// Total area.
    pub area: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum UnitShape {
    /// [-1/2, 1/2]² in the xy plane, facing −z.
    Square,
    /// Radius 1 in the xy plane, facing −z.
    Disk,
    /// Radius 1.
    Sphere,
    /// Radius 1 around x, length 1, no caps.
    Tube,
}

/// Where a ray meets an area light.
#[derive(Clone, Copy, Debug)]
pub(super) struct AreaHit {
    /// Ray parameter.
    pub t: f32,
    /// Point on the unit shape.
    p_unit: Vec3,
    /// Outward area vector per unit of unit-shape area.
    area_vector: Vec3,
}

impl AreaLight {
    /// None for shapes without area, which emit nothing.
    pub(super) fn new(light: &Light, origin_world: DVec3) -> Option<Self> {
        let (shape, dimensions) = match light.shape {
            LightShape::Rect { width, height } => {
                (UnitShape::Square, DVec3::new(width, height, 1.0))
            }
            LightShape::Disk { radius } => (UnitShape::Disk, DVec3::new(radius, radius, 1.0)),
            LightShape::Sphere { radius } => (UnitShape::Sphere, DVec3::splat(radius)),
            LightShape::Cylinder { radius, length } => {
                (UnitShape::Tube, DVec3::new(length, radius, radius))
            }
            LightShape::Distant { .. } | LightShape::Dome => return None,
        };
        let engine_from_unit = DAffine3::from_translation(-origin_world)
            * DAffine3::from_mat4(light.world_from_light)
            * DAffine3::from_scale(dimensions);
        let m = engine_from_unit.matrix3;
        let unit_from_engine = m.inverse();
        if !unit_from_engine.is_finite() {
            return None;
        }
        let cofactor = unit_from_engine.transpose() * m.determinant().abs();
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
        let is_close = |a: f64, b: f64| (a - b).abs() <= 1e-5 * a.max(b);
        let is_square_angle = |a: DVec3, b: DVec3| a.dot(b).abs() <= 1e-6 * a.length() * b.length();
        let is_sphere = shape == UnitShape::Sphere
            && is_close(x.length(), y.length())
            && is_close(x.length(), z.length())
            && is_square_angle(x, y)
            && is_square_angle(x, z)
            && is_square_angle(y, z);
        let is_rectangle = shape == UnitShape::Square && is_square_angle(x, y);
        let area = shape.area_under(&cofactor) as f32;
        let center = engine_from_unit.translation.as_vec3();
        let area_light = Self {
            shape,
            center,
            engine_from_unit: m.as_mat3(),
            unit_from_engine: unit_from_engine.as_mat3(),
            cofactor: cofactor.as_mat3(),
            sphere_radius: is_sphere.then(|| x.length() as f32),
            rectangle: is_rectangle.then(|| rectangle_around(center, x.as_vec3(), y.as_vec3())),
            emission: Emission::new(light),
            visible_to_camera: light.visible_to_camera,
            area,
        };
        (area > 0.0 && area.is_finite()).then_some(area_light)
    }

    /// A direction from `p` toward a point of the light.
    pub(super) fn sample(&self, p: Vec3, u: Vec2, textures: &TextureStore) -> Option<LightSample> {
        if let Some(cap) = self.cone_cap(p) {
            return self.sample_cone(p, cap, u, textures);
        }
        let rect = self.spherical_rect(p);
        let (p_unit, n_unit) = match &rect {
            Some(rect) => (
                self.unit_from_engine * (rect.sample(u) - self.center),
                Vec3::NEG_Z,
            ),
            None => self.shape.sample(u),
        };
        let to_light = self.center + self.engine_from_unit * p_unit - p;
        let distance_sq = to_light.length_squared();
        let distance = distance_sq.sqrt();
        let wi = to_light / distance;
        let area_vector = self.cofactor * n_unit;
        let area_cosine = -area_vector.dot(wi);
        if area_cosine <= 0.0 || !wi.is_finite() {
            return None;
        }
        let pdf = match rect {
            Some(rect) => rect.pdf(),
            // The Jacobian |area_vector| cancels: area_cosine carries it.
            None => distance_sq / (self.shape.area() * area_cosine),
        };
        Some(LightSample {
            wi,
            distance,
            radiance: self.emission.radiance(-wi, self.shape.st(p_unit), textures),
            pdf,
            is_delta: false,
        })
    }

    /// The light along a ray, if it is met on its emitting side within the ray's range.
    pub(super) fn intersect(&self, ray: &Ray) -> Option<AreaHit> {
        let o = self.unit_from_engine * (ray.origin - self.center);
        let d = self.unit_from_engine * ray.dir;
        let (t, n_unit) = self.shape.intersect(o, d, ray.t_min, ray.t_max)?;
        let area_vector = self.cofactor * n_unit;
        (area_vector.dot(ray.dir) < 0.0).then(|| AreaHit {
            t,
            p_unit: o + d * t,
            area_vector,
        })
    }

    /// Radiance against the unit direction `dir` in which the hit was found.
    pub(super) fn radiance(&self, hit: &AreaHit, dir: Vec3, textures: &TextureStore) -> Spectrum {
        self.emission
            .radiance(-dir, self.shape.st(hit.p_unit), textures)
    }

    /// Density per solid angle with which [`Self::sample`] at `p` chooses the unit direction `dir`
    /// toward the hit.
    pub(super) fn pdf(&self, p: Vec3, dir: Vec3, hit: &AreaHit) -> f32 {
        if let Some(cap) = self.cone_cap(p) {
            return warp::uniform_cone_pdf(cap);
        }
        if let Some(rect) = self.spherical_rect(p) {
            return rect.pdf();
        }
        hit.t * hit.t / (self.shape.area() * -hit.area_vector.dot(dir))
    }

    /// Bounds for the light tree.
    pub(super) fn bounds(&self) -> Bounds3 {
        let m = &self.engine_from_unit;
        let (x, y, z) = (m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
        let half = match self.shape {
            UnitShape::Square => 0.5 * x + 0.5 * y,
            UnitShape::Disk => x + y,
            UnitShape::Sphere => x + y + z,
            UnitShape::Tube => 0.5 * x + y + z,
        };
        Bounds3 {
            min: self.center - half,
            max: self.center + half,
        }
    }

    /// Axis of the cone of emitting normals and the cosine of its half angle.
    pub(super) fn normal_cone(&self) -> (Vec3, f32) {
        match self.shape {
            UnitShape::Square | UnitShape::Disk => {
                ((self.cofactor * Vec3::NEG_Z).normalize_or(Vec3::NEG_Z), 1.0)
            }
            UnitShape::Sphere | UnitShape::Tube => (Vec3::Z, -1.0),
        }
    }

    /// One minus the cosine of the angle a true sphere fills, seen from outside of it.
    fn cone_cap(&self, p: Vec3) -> Option<f32> {
        let radius_sq = self.sphere_radius? * self.sphere_radius?;
        let distance_sq = p.distance_squared(self.center);
        (distance_sq > radius_sq * (1.0 + 1e-4)).then(|| one_minus_cos(radius_sq / distance_sq))
    }

    fn sample_cone(
        &self,
        p: Vec3,
        cap: f32,
        u: Vec2,
        textures: &TextureStore,
    ) -> Option<LightSample> {
        let radius_sq = self.sphere_radius? * self.sphere_radius?;
        let to_center = self.center - p;
        let distance_sq = to_center.length_squared();
        let distance = distance_sq.sqrt();
        let local = warp::uniform_cone(u, cap);
        let wi = Frame::from_z(to_center / distance).from_local(local);
        let sin_sq = local.x * local.x + local.y * local.y;
        let t = distance * local.z - (radius_sq - distance_sq * sin_sq).max(0.0).sqrt();
        Some(LightSample {
            wi,
            distance: t.max(0.0),
            radiance: self.emission.radiance(-wi, Vec2::ZERO, textures),
            pdf: warp::uniform_cone_pdf(cap),
            is_delta: false,
        })
    }

    fn spherical_rect(&self, p: Vec3) -> Option<SphericalRect<'_>> {
        self.rectangle.as_ref()?.seen_from(p)
    }
}

fn rectangle_around(center: Vec3, edge_x: Vec3, edge_y: Vec3) -> Rectangle {
    Rectangle::new(center - 0.5 * (edge_x + edge_y), edge_x, edge_y)
}

impl UnitShape {
    fn area(self) -> f32 {
        match self {
            Self::Square => 1.0,
            Self::Disk => PI,
            Self::Sphere => 4.0 * PI,
            Self::Tube => 2.0 * PI,
        }
    }

    /// Area of the surface that an affine map with a cofactor matrix makes of the shape, by
    /// quadrature where the map distorts. In f64, as squares of areas leave the range of f32 for
    /// sizes of 1e-10 and 1e10.
    fn area_under(self, cofactor: &DMat3) -> f64 {
        const N: u32 = 32;
        let patches = (0..N * N).map(|i| {
            let u = Vec2::new((i % N) as f32 + 0.5, (i / N) as f32 + 0.5) / N as f32;
            (*cofactor * self.sample(u).1.as_dvec3()).length()
        });
        f64::from(self.area()) * patches.sum::<f64>() / f64::from(N * N)
    }

    /// A point uniform per area, and its outward normal.
    pub(super) fn sample(self, u: Vec2) -> (Vec3, Vec3) {
        match self {
            Self::Square => ((u - 0.5).extend(0.0), Vec3::NEG_Z),
            Self::Disk => (warp::concentric_disk(u).extend(0.0), Vec3::NEG_Z),
            Self::Sphere => {
                let n = warp::uniform_sphere(u);
                (n, n)
            }
            Self::Tube => {
                let (sin, cos) = (2.0 * PI * u.y).sin_cos();
                let n = Vec3::new(0.0, cos, sin);
                (n + (u.x - 0.5) * Vec3::X, n)
            }
        }
    }

    /// Texture coordinates of a point; (0, 0) at the lower left as seen from the lit side.
    pub(super) fn st(self, p: Vec3) -> Vec2 {
        match self {
            Self::Square => Vec2::new(0.5 - p.x, p.y + 0.5),
            Self::Disk | Self::Sphere | Self::Tube => Vec2::ZERO,
        }
    }

    /// First point within the range at which the ray meets the emitting side, with its normal.
    fn intersect(self, o: Vec3, d: Vec3, t_min: f32, t_max: f32) -> Option<(f32, Vec3)> {
        let in_range = |t: f32| (t > t_min && t < t_max).then_some(t);
        match self {
            Self::Square | Self::Disk => {
                let t = in_range(-o.z / d.z)?;
                let p = o + d * t;
                let is_inside = match self {
                    Self::Square => p.x.abs() <= 0.5 && p.y.abs() <= 0.5,
                    _ => p.x * p.x + p.y * p.y <= 1.0,
                };
                is_inside.then_some((t, Vec3::NEG_Z))
            }
            // The emitting side is the outside, so only the entry point counts.
            Self::Sphere => {
                let t = in_range(first_root(o, d)?)?;
                Some((t, o + d * t))
            }
            Self::Tube => {
                let across = Vec3::new(0.0, 1.0, 1.0);
                let t = in_range(first_root(o * across, d * across)?)?;
                let p = o + d * t;
                (p.x.abs() <= 0.5).then(|| (t, Vec3::new(0.0, p.y, p.z)))
            }
        }
    }
}

/// Where a line enters the unit sphere. All in `f64`: products of `f32` lose a radius of one in the
/// distance squared.
fn first_root(o: Vec3, d: Vec3) -> Option<f32> {
    let (o, d) = (o.as_dvec3(), d.as_dvec3());
    let (a, half_b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
    let discriminant = half_b * half_b - a * c;
    if a <= 0.0 || discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    // The form that does not cancel (Press et al.).
    let t = if half_b > 0.0 {
        (-half_b - root) / a
    } else {
        c / (root - half_b)
    };
    Some(t as f32)
}

/// 1 − sqrt(1 − sin²), without cancellation for small angles.
fn one_minus_cos(sin_sq: f32) -> f32 {
    sin_sq / (1.0 + (1.0 - sin_sq).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines that pass the center of a unit sphere or tube within a thousandth of its radius meet
    /// it, and others do not, from however far.
    #[test]
    fn far_lights_keep_their_size() {
        for distance in [10.0, 1e3, 2e4_f32] {
            for i in 0..200 {
                let angle = i as f32;
                let o = distance * Vec3::new(0.0, angle.cos(), angle.sin());
                let aside = Vec3::new(0.0, -angle.sin(), angle.cos());
                let d = (aside * (0.9 + 0.001 * i as f32) - o).normalize();
                // What rounding of the direction has made of it.
                let (o_exact, d_exact) = (o.as_dvec3(), d.as_dvec3());
                let passes_at = o_exact.cross(d_exact).length() / d_exact.length();
                if (passes_at - 1.0).abs() > 1e-3 {
                    for shape in [UnitShape::Sphere, UnitShape::Tube] {
                        let hit = shape.intersect(o, d, 0.0, f32::INFINITY);
                        let what = format!("{shape:?} from {distance}, {passes_at}");
                        assert_eq!(hit.is_some(), passes_at < 1.0, "{what}");
                    }
                }
            }
        }
    }
}
