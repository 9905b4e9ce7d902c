//! Scattering of light on its way from a light, where BSDFs are made for the way from the camera.

use kilauea_bsdf::{Bsdf, BsdfSample, SeenBsdf};
use kilauea_math::{Spectrum, Vec2, Vec3};

use super::MIN_ROUGHNESS;
use super::horizons::BetweenHorizons;

/// Light that leaves a surface, as shares of what arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScatteredLight {
    /// Where it goes: a unit vector.
    pub(super) wo: Vec3,
    /// What diffuse lobes made of it.
    pub(super) diffuse: Spectrum,
    /// What all other lobes made of it.
    pub(super) specular: Spectrum,
    /// What narrow lobes made of it, a part of that.
    pub(super) narrow: Spectrum,
    /// Density of `wo`; for delta lobes the probability of the lobe.
    pub(super) pdf: f32,
    /// Density with which a camera path that comes along `wo` would go on to where the light came
    /// from; for delta lobes the probability of the lobe.
    pub(super) reverse_pdf: f32,
    /// Whether `wo` was the only direction possible.
    pub(super) is_delta: bool,
    /// Whether light crossed the surface.
    pub(super) is_transmission: bool,
    /// Roughness of the lobe that `wo` was drawn from.
    pub(super) roughness: f32,
}

impl ScatteredLight {
    /// Whether a mirror scattered it.
    pub(super) fn is_mirrored(&self) -> bool {
        self.is_delta && !self.is_transmission
    }
}

/// Draws where light goes on that arrives from the unit vector `wi`; `ng` is the geometric normal on
/// either side, `seen` is `bsdf` seen from `wi`.
///
/// What scatters is the adjoint of the BSDF: f(wi → wo) as seen from wo, the camera's side, times
/// the cosines of Veach (1997, eq. 5.19), |wi·ns| |wo·ng| / |wi·ng|. The photons arrive by area of
/// the true surface, and the shading normal changes what of them is scattered.
pub(super) fn sample_adjoint(
    bsdf: &Bsdf,
    seen: &SeenBsdf,
    ng: Vec3,
    wi: Vec3,
    [u_lobe, u_x, u_y]: [f32; 3],
) -> Option<ScatteredLight> {
    let side = if wi.dot(ng) < 0.0 { -1.0 } else { 1.0 };
    let (ng, ns) = (side * ng, side * bsdf.ns());
    let below = BetweenHorizons::of(ng, ns).filter(|_| seen.has_smooth_lobes());
    let share_below = below.map_or(0.0, |below| below.share());
    let sample = match below {
        Some(below) if u_lobe < share_below => {
            let (wo, pdf) = below.sample(Vec2::new(u_x, u_y));
            BsdfSample {
                wi: wo,
                pdf: pdf * share_below,
                diffuse: Spectrum::BLACK,
                specular: Spectrum::BLACK,
                is_delta: false,
                is_transmission: false,
                is_diffuse: false,
                roughness: 1.0,
            }
        }
        _ => {
            let above = 1.0 - share_below;
            let sample = seen.sample([(u_lobe - share_below) / above, u_x, u_y])?;
            BsdfSample {
                pdf: sample.pdf * above,
                diffuse: sample.diffuse / above,
                specular: sample.specular / above,
                ..sample
            }
        }
    };
    weigh(bsdf, ng, ns, wi, &sample)
}

/// Density with which [`sample_adjoint`] draws `wo` by lobes that are no mirrors.
pub(crate) fn adjoint_pdf(bsdf: &Bsdf, ng: Vec3, wi: Vec3, wo: Vec3) -> f32 {
    let seen = bsdf.seen_from(wi);
    let side = if wi.dot(ng) < 0.0 { -1.0 } else { 1.0 };
    let (ng, ns) = (side * ng, side * bsdf.ns());
    let by_bsdf = seen.eval(wo).pdf;
    match BetweenHorizons::of(ng, ns).filter(|_| seen.has_smooth_lobes()) {
        Some(below) => (1.0 - below.share()) * by_bsdf + below.share() * below.pdf(wo),
        None => by_bsdf,
    }
}

/// The share of light that goes into a direction which was drawn with the density of `sample`.
fn weigh(bsdf: &Bsdf, ng: Vec3, ns: Vec3, wi: Vec3, sample: &BsdfSample) -> Option<ScatteredLight> {
    let BsdfSample {
        wi: wo,
        pdf,
        is_delta,
        is_transmission,
        roughness,
        ..
    } = *sample;
    let true_cosines = wo.dot(ng).abs() / wi.dot(ng).abs();
    if !true_cosines.is_finite() {
        return None;
    }
    let (diffuse, specular, narrow, reverse_pdf) = if is_delta {
        // The sample's weight has f |wo·ns|.
        let factor = wi.dot(ns).abs() / wo.dot(ns).abs() * true_cosines;
        let specular = sample.specular * factor;
        (sample.diffuse * factor, specular, specular, pdf)
    } else {
        // Has f |wi·ns|.
        let seen = bsdf.seen_from(wo);
        let eval = seen.eval(wi);
        let narrow = seen.eval_narrow(wi, MIN_ROUGHNESS);
        let factor = true_cosines / pdf;
        let [diffuse, specular, narrow] =
            [eval.diffuse, eval.specular, narrow].map(|light| light * factor);
        (diffuse, specular, narrow, eval.pdf)
    };
    Some(ScatteredLight {
        wo,
        diffuse,
        specular,
        narrow,
        pdf,
        reverse_pdf,
        is_delta,
        is_transmission,
        roughness,
    })
}

#[cfg(test)]
mod tests;
