use kilauea_math::{INV_PI, Vec2, Vec3};
use std::f32::consts::TAU;

/// Below this alpha a lobe is a delta lobe: `f32` does not resolve it.
pub(crate) const MIN_ALPHA: f32 = 1.0e-3;

/// Isotropic GGX microfacets with height-correlated Smith masking (Walter et al. 2007; Heitz
/// 2014), seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ggx {
    alpha: f32,
    /// Cosine between normal and `wo`, positive.
    cos_o: f32,
    /// `sqrt(cos² + alpha² sin²)` of `wo`.
    stretch_o: f32,
    /// How far the spherical cap of [`Self::sample`] reaches below the horizon.
    cap: f32,
}

/// Half vector of a reflection, relative to the normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Half {
    cos2: f32,
    sin2: f32,
    /// Cosine between the half vector and either direction.
    pub(crate) cos_d: f32,
}

impl Half {
    /// None for opposite directions.
    #[inline]
    pub(crate) fn between(n: Vec3, wo: Vec3, wi: Vec3) -> Option<Self> {
        let sum = wo + wi;
        let length2 = sum.length_squared();
        if length2 < 1.0e-12 {
            return None;
        }
        // The sine from the cross product: 1 − cos² would cancel where the lobe is narrow.
        Some(Self {
            cos2: n.dot(sum).powi(2) / length2,
            sin2: n.cross(sum).length_squared() / length2,
            cos_d: (0.5 * length2.sqrt()).min(1.0),
        })
    }
}

/// Reflection by microfacets that reflect everything.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reflection {
    /// BRDF times the cosine of `wi`.
    pub(crate) f_cos: f32,
    /// Density of [`Ggx::sample`] per solid angle of `wi`.
    pub(crate) pdf: f32,
}

impl Ggx {
    /// `alpha` in [`MIN_ALPHA`, 1]; `cos_o` in (0, 1].
    #[inline]
    pub(crate) fn new(alpha: f32, cos_o: f32) -> Self {
        let alpha2 = alpha * alpha;
        let cos2_o = cos_o * cos_o;
        let sin2_o = (1.0 - cos2_o).max(0.0);
        let s2 = (1.0 + sin2_o.sqrt()).powi(2);
        Self {
            alpha,
            cos_o,
            stretch_o: (cos2_o + alpha2 * sin2_o).sqrt(),
            cap: (1.0 - alpha2) * s2 / (s2 + alpha2 * cos2_o),
        }
    }

    /// `cos_i` > 0 is the cosine between normal and `wi`.
    #[inline]
    pub(crate) fn eval(&self, half: &Half, cos_i: f32) -> Reflection {
        let alpha2 = self.alpha * self.alpha;
        let d = half.sin2 + alpha2 * half.cos2;
        let distribution = alpha2 * INV_PI / (d * d);
        let stretch_i = (cos_i * cos_i * (1.0 - alpha2) + alpha2).sqrt();
        let visibility = 0.5 / (cos_i * self.stretch_o + self.cos_o * stretch_i);
        Reflection {
            f_cos: distribution * visibility * cos_i,
            pdf: distribution * self.pdf_scale(),
        }
    }

    /// Density of [`Self::sample`] over the distribution of normals.
    #[inline]
    fn pdf_scale(&self) -> f32 {
        0.5 / (self.cap * self.cos_o + self.stretch_o)
    }

    /// Draws a direction for `wo` in the frame of the normal, by visible normals: a spherical cap
    /// (Dupuy & Benyoub 2023) bounded to normals that reflect upward (Eto & Tokuyoshi 2023). May
    /// still be below the horizon.
    #[inline]
    pub(crate) fn sample(&self, wo: Vec3, u: Vec2) -> Vec3 {
        let wo_std = Vec3::new(wo.x * self.alpha, wo.y * self.alpha, wo.z).normalize();
        let b = self.cap * wo_std.z;
        let z = (1.0 - u.y) * (1.0 + b) - b;
        let sin_theta = (1.0 - z * z).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u.x).sin_cos();
        let m_std = wo_std + Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, z);
        let m =
            Vec3::new(m_std.x * self.alpha, m_std.y * self.alpha, m_std.z).normalize_or(Vec3::Z);
        (2.0 * wo.dot(m) * m - wo).normalize_or(Vec3::Z)
    }
}
