use kilauea_math::{Spectrum, Vec3};

/// What a path learnt where it scattered, once it had ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherRecord {
    /// Where it scattered, engine space.
    pub p: Vec3,
    /// Unit shading normal on the side that is seen.
    pub n: Vec3,
    /// Unit direction that it took, from which the light came.
    pub wi: Vec3,
    /// Estimate of the irradiance by light along `wi`: `L |cos θ| / pdf` in luminance; 0 where no
    /// light came, or where the path ended.
    pub irradiance: f32,
    /// Density per solid angle with which `wi` was drawn.
    pub pdf: f32,
    /// Estimate of the radiance that leaves toward the viewer for light that came along paths, per
    /// albedo of the surface.
    pub radiance: Spectrum,
    /// Rays that the path traced from there on.
    pub n_rays: f32,
}

impl GatherRecord {
    /// Whether it says anything: no NaN, no infinity, nothing negative.
    pub(crate) fn is_sound(&self) -> bool {
        let vectors = [self.p, self.n, self.wi];
        vectors.iter().all(|v| v.is_finite())
            && self.irradiance.is_finite()
            && self.irradiance >= 0.0
            && self.pdf.is_finite()
            && self.pdf > 0.0
            && self.radiance.is_finite()
            && self.n_rays.is_finite()
    }
}
