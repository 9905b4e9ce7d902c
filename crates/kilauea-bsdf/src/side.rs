use kilauea_math::{Frame, Vec3};

/// The side of the surface that `wo` is on: normals turned to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    /// Shading frame; z is on the side of `wo`, as the geometric normal sees it.
    pub(crate) frame: Frame,
    /// Geometric normal on the side of `wo`.
    pub(crate) ng: Vec3,
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
            }
        } else {
            Self { frame: *frame, ng }
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
