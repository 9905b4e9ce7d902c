//! Points on triangles with what their rounding amounts to, and rays that leave them.

use kilauea_math::{DAffine3, DMat3, DVec3, Vec3};

/// Unit roundoff of `f64`.
const UNIT_F64: f64 = f64::EPSILON * 0.5;

/// A point on a triangle in engine space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, rounded.
    pub p: Vec3,
    /// Unit normal; by the right hand the corners run around it. Zero where there is no area.
    pub ng: Vec3,
    /// By axis: how far `p` may be from the triangle that rays are tested against.
    pub p_error: Vec3,
}

/// Bound on what taking a ray into the space of a placed geometry loses, in `f64`.
///
/// With M the matrix and t the translation of a placement, the rounding of M⁻¹ (p − t) moves the
/// point by at most a few units in the last place of |M| |M⁻¹| (|p| + |t|), back in engine space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementError {
    factor: f64,
    translation: f64,
}

impl SurfacePoint {
    /// The point with weights `u` and `v` of the second and third corner.
    ///
    /// `corners` are in engine space, placed in `f64` by the matrix that the accelerator was given.
    /// The point is rounded once, and that rounding is known, as is that of corners which the
    /// accelerator may have baked in `f32`. What else there is happens in `f64`: the placement,
    /// and the distance that the kernels find. The latter comes from edge functions, so with the
    /// longest edge L and the area A it is uncertain by L³/A units in the last place, measured
    /// along the normal.
    #[inline]
    pub fn on_triangle(corners: [DVec3; 3], u: f32, v: f32, placement: &PlacementError) -> Self {
        let [a, b, c] = corners;
        let (ab, ac) = (b - a, c - a);
        let p_exact = a + f64::from(u) * ab + f64::from(v) * ac;
        let cross = ab.cross(ac);
        let double_area = cross.length();
        let longest2 = ab
            .length_squared()
            .max(ac.length_squared())
            .max((c - b).length_squared());

        let of_corners = rounding(a).max(rounding(b)).max(rounding(c));
        let longest = longest2.sqrt();
        let of_distance = (64.0 * UNIT_F64 * longest * (longest2 / double_area)).min(longest);
        let extent = a.abs().max(b.abs()).max(c.abs()).max_element();
        let in_f64 = of_distance + placement.at(extent);
        let p_error = rounding(p_exact) + of_corners + DVec3::splat(in_f64);
        Self {
            p: p_exact.as_vec3(),
            ng: (cross / double_area.max(f64::MIN_POSITIVE)).as_vec3(),
            p_error: p_error.as_vec3(),
        }
    }

    /// Where a ray toward `dir` starts; see [`offset_origin`].
    #[inline]
    pub fn offset_origin(&self, dir: Vec3) -> Vec3 {
        offset_origin(self.p, self.p_error, self.ng, dir)
    }
}

impl PlacementError {
    /// Of geometry that is given in engine space.
    pub const NONE: Self = Self {
        factor: 8.0 * UNIT_F64,
        translation: 0.0,
    };

    /// Of geometry under a matrix.
    pub fn of(world_from_geometry: &DAffine3) -> Self {
        Self {
            factor: 16.0 * UNIT_F64 * condition(&world_from_geometry.matrix3),
            translation: world_from_geometry.translation.abs().max_element(),
        }
    }

    #[inline]
    fn at(&self, extent: f64) -> f64 {
        self.factor * (extent + self.translation)
    }
}

/// How much larger roundings can become by a matrix and its inverse: the largest row sum of
/// |M| |M⁻¹|.
fn condition(m: &DMat3) -> f64 {
    let abs = |m: &DMat3| DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    (abs(m) * abs(&m.inverse()) * DVec3::ONE).max_element()
}

/// The point `p`, moved along the unit normal `n` to the side of `dir`, just as far as an error of
/// up to `p_error` in each axis could have put it on the other side (PBR 4ed., 6.8.6).
#[inline]
pub fn offset_origin(p: Vec3, p_error: Vec3, n: Vec3, dir: Vec3) -> Vec3 {
    // Room for the rounding of `n` and of this product.
    const MARGIN: f32 = 1.0 + 8.0 * f32::EPSILON;
    let distance = n.abs().dot(p_error) * MARGIN;
    // In `f64` the sign is that of the vectors, however close to the surface `dir` is.
    let cos = dir.as_dvec3().dot(n.as_dvec3());
    let offset = n * distance.copysign(cos as f32);
    // The sum rounds too: step outward where it fell short.
    let moved = p + offset;
    Vec3::new(
        step_away(moved.x, offset.x),
        step_away(moved.y, offset.y),
        step_away(moved.z, offset.z),
    )
}

/// What a point loses when it is rounded to `f32`.
#[inline]
fn rounding(p: DVec3) -> DVec3 {
    (p - p.as_vec3().as_dvec3()).abs()
}

/// The next number in the direction of `offset`.
#[inline]
fn step_away(x: f32, offset: f32) -> f32 {
    if offset > 0.0 {
        x.next_up()
    } else if offset < 0.0 {
        x.next_down()
    } else {
        x
    }
}
