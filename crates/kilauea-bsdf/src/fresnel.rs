use kilauea_math::{Spectrum, Vec3};

/// Schlick's weight of the reflectance at grazing incidence: (1 − cos)⁵.
#[inline]
pub(crate) fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Schlick's approximation between the reflectances at normal and grazing incidence (Schlick
/// 1994).
#[inline]
pub(crate) fn schlick(f0: Spectrum, f90: Spectrum, cos: f32) -> Spectrum {
    f0.lerp(f90, schlick_weight(cos))
}

/// Where light goes at a smooth boundary between dielectrics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dielectric {
    /// Unpolarised reflectance; 1 for total internal reflection.
    pub(crate) reflectance: f32,
    /// Cosine between the normal and the refracted ray on the far side.
    pub(crate) cos_t: f32,
}

/// Fresnel's equations (PBR 4ed., eq. 9.6): `cos_o` ≥ 0 on the near side, `eta` is the index of the
/// far side over that of the near side.
#[inline]
pub(crate) fn dielectric(cos_o: f32, eta: f32) -> Dielectric {
    let sin2_t = (1.0 - cos_o * cos_o) / (eta * eta);
    if sin2_t >= 1.0 {
        return Dielectric {
            reflectance: 1.0,
            cos_t: 0.0,
        };
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos_o - cos_t) / (eta * cos_o + cos_t);
    let perpendicular = (cos_o - eta * cos_t) / (cos_o + eta * cos_t);
    Dielectric {
        reflectance: 0.5 * (parallel * parallel + perpendicular * perpendicular),
        cos_t,
    }
}

/// The mirror direction of `wo`.
#[inline]
pub(crate) fn reflect(wo: Vec3, n: Vec3) -> Vec3 {
    (2.0 * wo.dot(n) * n - wo).normalize()
}

/// The direction in which `wo` goes on behind the boundary (Snell's law); see [`dielectric`].
#[inline]
pub(crate) fn refract(wo: Vec3, n: Vec3, cos_o: f32, eta: f32, cos_t: f32) -> Vec3 {
    ((cos_o / eta - cos_t) * n - wo / eta).normalize()
}

/// Reflectance at normal incidence of a dielectric in air.
#[inline]
pub fn f0_from_ior(ior: f32) -> f32 {
    let r = (1.0 - ior) / (1.0 + ior);
    r * r
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectric_at_known_angles() {
        assert!((dielectric(1.0, 1.5).reflectance - 0.04).abs() < 1e-6);
        assert!((dielectric(0.0, 1.5).reflectance - 1.0).abs() < 1e-6);
        assert_eq!(dielectric(0.5, 1.0 / 1.5).reflectance, 1.0);
        // Brewster's angle: half of the unpolarised light sees no boundary.
        let cos_brewster = 1.0 / (1.0_f32 + 1.5 * 1.5).sqrt();
        let perpendicular = (1.5_f32 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0);
        let found = dielectric(cos_brewster, 1.5).reflectance;
        assert!((found - 0.5 * perpendicular * perpendicular).abs() < 1e-6);
    }

    #[test]
    fn both_ways_through_a_boundary_reflect_alike() {
        for i in 0..=20 {
            let cos_o = i as f32 / 20.0;
            let there = dielectric(cos_o, 1.33);
            let back = dielectric(there.cos_t, 1.0 / 1.33);
            assert!((there.reflectance - back.reflectance).abs() < 1e-4);
        }
    }

    #[test]
    fn refraction_obeys_snell() {
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let d = dielectric(0.8, 1.5);
        let wi = refract(wo, Vec3::Z, 0.8, 1.5, d.cos_t);
        assert!((wi.length() - 1.0).abs() < 1e-6 && wi.z < 0.0);
        assert!((wi.x + 0.4).abs() < 1e-6, "{wi}");
    }
}
