use std::f32::consts::PI;

/// How much a photon counts by its distance, over the area of a disc.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// 1 everywhere.
    Constant,
    /// 2 (1 - d² / r²) (Epanechnikov 1969; Silverman 1986 for two dimensions).
    #[default]
    Epanechnikov,
}

impl Kernel {
    /// The weight in 1/m² of a photon at the squared distance `d_sq` of a disc's centre. It
    /// integrates to one over the disc; a disc without area has none, so that many photons at one
    /// place are not infinitely bright.
    #[inline]
    pub fn weight(self, d_sq: f32, radius_sq: f32) -> f32 {
        if radius_sq < f32::MIN_POSITIVE {
            return 0.0;
        }
        let per_area = 1.0 / (PI * radius_sq);
        match self {
            Self::Constant => per_area,
            Self::Epanechnikov => 2.0 * (1.0 - d_sq / radius_sq) * per_area,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_testing::integrate;

    #[test]
    fn weights_integrate_to_one() {
        let radius = 0.7_f32;
        for kernel in [Kernel::Constant, Kernel::Epanechnikov] {
            // Over the area π d², from zero to that of the disc.
            let weight = |d_sq: f64| f64::from(kernel.weight(d_sq as f32, radius * radius));
            let integral = integrate(
                [0.0, 0.0],
                [f64::from(radius).powi(2), 1.0],
                1e-6,
                &mut |[d_sq, _]| std::f64::consts::PI * weight(d_sq),
            );
            assert!((integral - 1.0).abs() < 1e-5, "{kernel:?}: {integral}");
        }
    }
}
