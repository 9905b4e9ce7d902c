use kilauea_math::{Frame, Vec3};

/// The side of the surface that `wo` is on: normals turned to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    /// Shading frame; z is on the side of `wo`, as the geometric normal sees it.
    pub(crate) frame: Frame,
    /// Geometric normal on the side of `wo`.
    pub(crate) ng: Vec3,
    /// Whether that is the outside.
    pub(crate) is_outside: bool,
}

impl Side {
    #[inline]
    pub(crate) fn of(frame: &Frame, ng: Vec3, wo: Vec3) -> Self {
        if ng.dot(wo) < 0.0 {
            Self {
                frame: Frame {
                    x: -frame.x,
                    y: frame.y,
                    z: -frame.z,
                },
                ng: -ng,
                is_outside: false,
            }
        } else {
            Self {
                frame: *frame,
                ng,
                is_outside: true,
            }
        }
    }

    /// The same with the shading normal pulled toward `wo` as far as needed for `wo` to see the
    /// surface from above.
    #[inline]
    pub(crate) fn visible_from(self, wo: Vec3) -> Self {
        const MIN_COS: f32 = 1.0e-3;
        let cos_o = self.frame.z.dot(wo);
        if cos_o >= MIN_COS {
            return self;
        }
        let n = (self.frame.z + (MIN_COS - cos_o) * wo).normalize_or(self.ng);
        Self {
            frame: Frame::from_z(n),
            ..self
        }
    }

    /// Cosine between the shading normal and `wi`, where both normals have `wi` on this side;
    /// otherwise none.
    #[inline]
    pub(crate) fn reflected_cos(&self, wi: Vec3) -> Option<f32> {
        let cos_i = self.frame.z.dot(wi);
        (cos_i > 0.0 && self.ng.dot(wi) > 0.0).then_some(cos_i)
    }
}
