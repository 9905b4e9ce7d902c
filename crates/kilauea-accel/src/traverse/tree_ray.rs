use kilauea_math::DVec3;

/// A ray in the space of one tree, with all that the tests derive from it.
///
/// The box and edge tests run in `f32` from an origin moved `t_start` along the ray, so that an
/// instance far from its viewer still sees coordinates of its own size; distances inside the tree
/// count from there. Accepted hits are computed in `f64` from the true origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeRay {
    /// Moved origin.
    pub(crate) origin: [f32; 3],
    /// Reciprocal direction a little too small: distances to near planes come out too near.
    pub(crate) near_rcp: [f32; 3],
    /// Reciprocal direction a little too large.
    pub(crate) far_rcp: [f32; 3],
    /// Row of `Node8::planes` that the ray meets first, by axis; the last is this with bit 0
    /// flipped.
    pub(crate) near_plane: [usize; 3],
    /// The axes in cyclic order, that of the largest direction component last.
    pub(crate) axes: [usize; 3],
    /// Shear that takes the direction to the last axis (Woop et al. 2013).
    pub(crate) shear: [f32; 2],
    /// Least distance in the tree.
    pub(crate) t_min: f32,
    /// How far the origin was moved.
    pub(crate) t_start: f32,
    /// Origin, not moved.
    pub(crate) origin_f64: [f64; 3],
    /// Direction.
    pub(crate) dir_f64: [f64; 3],
}

impl TreeRay {
    /// A ray from `origin` along `dir` from `t_min` on, moved by `t_start <= t_min`.
    #[inline(always)]
    pub(crate) fn new(origin: DVec3, dir: DVec3, t_min: f32, t_start: f32) -> Self {
        const ULP: f32 = f32::EPSILON;
        let moved = (origin + dir * f64::from(t_start)).as_vec3().to_array();
        let d = dir.as_vec3().to_array();

        let largest = {
            let [x, y, z] = d.map(f32::abs);
            if x > y && x > z {
                0
            } else if y > z {
                1
            } else {
                2
            }
        };
        let axes = [(largest + 1) % 3, (largest + 2) % 3, largest];
        let rcp_largest = 1.0 / d[axes[2]];
        let rcp = d.map(|x| 1.0 / x.abs().max(1e-18).copysign(x));
        Self {
            origin: moved,
            near_rcp: rcp.map(|x| x * (1.0 - 3.0 * ULP)),
            far_rcp: rcp.map(|x| x * (1.0 + 3.0 * ULP)),
            near_plane: [0, 1, 2].map(|axis| 2 * axis + usize::from(d[axis].is_sign_negative())),
            axes,
            shear: [d[axes[0]] * rcp_largest, d[axes[1]] * rcp_largest],
            t_min: (t_min - t_start) * (1.0 - ULP),
            t_start,
            origin_f64: origin.to_array(),
            dir_f64: dir.to_array(),
        }
    }

    /// A distance of the whole ray, as a bound for distances in the tree.
    #[inline(always)]
    pub(crate) fn limit(&self, t: f32) -> f32 {
        (t - self.t_start) * (1.0 + f32::EPSILON)
    }
}
