use super::edges::EdgeProduct;

/// What a path from a light carries so that its caustic photons can be weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSubpath(EdgeProduct);

impl LightSubpath {
    /// A path that leaves a light with the density `emission_pdf`: that of the point in 1/m² times
    /// that of the direction in 1/sr, for lights at infinity that of the direction times that of
    /// the point on the disc through which it enters. `cos_light` is the cosine at the light, or 1
    /// if points are chosen across the direction, as for lights at infinity. Both with the
    /// probability of choosing the light.
    #[must_use]
    pub fn emitted(emission_pdf: f32, cos_light: f32) -> Self {
        Self(EdgeProduct(cos_light / emission_pdf))
    }

    /// The next surface is met at the (absolute) cosine `cos_in`.
    #[must_use]
    pub fn arrived(self, cos_in: f32) -> Self {
        Self(self.0.arrived(cos_in))
    }

    /// The path was scattered with the density `forward_pdf`, at the cosine `cos_out` to the next
    /// edge. `reverse_pdf` is the density of the direction back, if the path came from the other
    /// side: at the first surface after the light that of hitting the light by sampling the BSDF
    /// plus that of connecting to it, both over solid angle.
    #[must_use]
    pub fn scattered(self, forward_pdf: f32, reverse_pdf: f32, cos_out: f32) -> Self {
        Self(self.0.scattered(forward_pdf, reverse_pdf, cos_out))
    }

    /// What a photon that is stored here carries: the sum of the densities of hitting and connecting
    /// over p_L, for one unit of the density with which the eye samples the direction back; m² sr.
    pub fn d_eye(self) -> f32 {
        self.0.0
    }
}
