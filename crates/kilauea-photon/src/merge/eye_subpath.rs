use super::edges::EdgeProduct;

/// What an eye path carries from its last rough vertex over near-specular ones to a light: p_L over
/// its own density since that vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeSubpath(EdgeProduct);

impl EyeSubpath {
    /// A path that leaves a rough vertex in a direction with the density `pdf` over solid
    /// angle, at the cosine `cos_out`.
    #[must_use]
    pub fn left_rough(pdf: f32, cos_out: f32) -> Self {
        Self(EdgeProduct(cos_out / pdf))
    }

    /// The next surface is met at the (absolute) cosine `cos_in`.
    #[must_use]
    pub fn arrived(self, cos_in: f32) -> Self {
        Self(self.0.arrived(cos_in))
    }

    /// The path was scattered by a near-specular surface with the density `forward_pdf`, at the cosine
    /// `cos_out` to the next edge; `reverse_pdf` is the density with which light that comes along
    /// the next edge goes back along the last one.
    #[must_use]
    pub fn scattered(self, forward_pdf: f32, reverse_pdf: f32, cos_out: f32) -> Self {
        Self(self.0.scattered(forward_pdf, reverse_pdf, cos_out))
    }

    /// p_L over the density of the whole path, in 1/m², where it ends at a light with `cos_light` and
    /// `emission_pdf` as for [`LightSubpath::emitted`](crate::LightSubpath::emitted).
    pub fn d_light(self, emission_pdf: f32, cos_light: f32) -> f32 {
        self.0.0 * emission_pdf / cos_light
    }
}
