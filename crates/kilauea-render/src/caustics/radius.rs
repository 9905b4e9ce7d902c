//! How far the first sample of a frame merges, and what that is worth.

use std::f32::consts::FRAC_1_PI;
use std::f64::consts::PI;
use std::num::NonZeroUsize;

use kilauea_math::Spectrum;
use kilauea_photon::{DensityRule, Photon, PhotonMap, SurfaceQuery};

use crate::integrator::ArrivingPhoton;
use crate::photon::Importon;

/// Photons by whose distance their density is told.
const N_NEAREST: NonZeroUsize = NonZeroUsize::new(8).expect("not zero");
/// Photons that one look-up of the first sample is to find.
const N_MERGED: f32 = 4.0;
/// Least radius of the first sample, in pixels: a smaller one shows nothing more.
const MIN_PIXELS: f32 = 0.5;
/// Greatest radius of the first sample, in pixels: noise between neighbours is less in the way than
/// light that has come from elsewhere.
const MAX_PIXELS: f32 = 6.0;

/// A place that gets caustic light.
struct Lit {
    /// Luminance that the camera gets.
    luminance: f32,
    /// Radius within which one look-up finds enough photons.
    radius: f32,
    /// Width of a pixel.
    pixel_width: f32,
    /// Variance of a sample of paths that find the light by chance.
    variance: f64,
}

/// What the caustic photons of a pilot tell.
pub(super) struct CausticLight {
    /// Radius of the first sample.
    pub(super) radius: f32,
    /// Variance of a sample of paths that find the light by chance, summed over importons.
    pub(super) variance: f64,
}

/// The radius within which a look-up finds a few photons where the light is that they bring,
/// by the caustic photons of `n_traced` paths; a sample gets those of `n_per_sample`. None where no
/// light is found.
///
/// `block` is the number of pixels along the side of an importon's square.
pub(super) fn first_radius(
    importons: &[Importon],
    photons: &[Photon],
    n_traced: u32,
    n_per_sample: u32,
    block: u32,
) -> Option<CausticLight> {
    let map = PhotonMap::build(photons);
    let photon_ratio = n_traced as f32 / n_per_sample.max(1) as f32;
    let scale = (photon_ratio * N_MERGED / N_NEAREST.get() as f32).sqrt();
    let lit: Vec<Lit> = importons
        .iter()
        .filter_map(|importon| {
            let (luminance, distance) = caustic_at(importon, &map)?;
            Some(Lit {
                luminance,
                radius: distance * scale,
                pixel_width: importon.width / block as f32,
                variance: variance_by_chance(importon, &map, distance, n_traced),
            })
        })
        .collect();
    let radius = weighted_median(&lit, |lit| lit.radius)?;
    let pixel_width = weighted_median(&lit, |lit| lit.pixel_width)?;
    Some(CausticLight {
        radius: radius.clamp(MIN_PIXELS * pixel_width, MAX_PIXELS * pixel_width),
        variance: lit.iter().map(|lit| lit.variance).sum(),
    })
}

/// Variance of a sample of a camera path by chance at an importon, by the photons of `n_traced` paths within a
/// radius. Where such a path finds the light of a photon with q over an area, of which the photon has N p,
/// its second moment is f²/q: of a photon that brings b to a unit of area, b² N p / q.
fn variance_by_chance(importon: &Importon, map: &PhotonMap, radius: f32, n_traced: u32) -> f64 {
    let query = SurfaceQuery {
        p: importon.p,
        n: importon.n,
    };
    let scattered = importon.throughput * importon.albedo * FRAC_1_PI;
    let mut sum = 0.0;
    ArrivingPhoton::for_each(map, &query, radius, |photon| {
        let brought = f64::from((scattered * photon.power).luminance());
        let pdf = importon.n_shading.dot(photon.wi) * FRAC_1_PI;
        if pdf > 0.0 {
            // Paths do not find it at all, where that is zero.
            let q_over_p = f64::from((photon.d_eye * pdf).max(f32::MIN_POSITIVE));
            sum += brought * brought * f64::from(n_traced) / q_over_p;
        }
    });
    sum / (PI * f64::from(radius * radius))
}

/// Luminance that the camera gets of the photons around an importon, and how far they are.
fn caustic_at(importon: &Importon, map: &PhotonMap) -> Option<(f32, f32)> {
    let query = SurfaceQuery {
        p: importon.p,
        n: importon.n,
    };
    let rule = DensityRule::default();
    let near = map.nearest_on_surface(&query, N_NEAREST, f32::INFINITY, &rule);
    let farthest_sq = near.get(N_NEAREST.get() - 1)?.d_sq;
    let flux: Spectrum = near.iter().map(|photon| photon.power).sum();
    let per_area = importon.throughput * importon.albedo * flux / farthest_sq;
    let luminance = per_area.luminance();
    (luminance > 0.0 && luminance.is_finite()).then(|| (luminance, farthest_sq.sqrt()))
}

/// The value below which half of all luminance is.
fn weighted_median(lit: &[Lit], value: impl Fn(&Lit) -> f32) -> Option<f32> {
    let mut by_value: Vec<&Lit> = lit.iter().collect();
    by_value.sort_by(|a, b| value(a).total_cmp(&value(b)));
    let luminance = |lit: &&Lit| f64::from(lit.luminance);
    let half = 0.5 * by_value.iter().map(luminance).sum::<f64>();
    let mut sum = 0.0;
    let middle = by_value.into_iter().find(|lit| {
        sum += luminance(lit);
        sum >= half
    });
    middle.map(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_light_is_on_either_side_of_the_median() {
        let at = |luminance, radius| Lit {
            luminance,
            radius,
            pixel_width: 1.0,
            variance: 0.0,
        };
        let lit = [at(1.0, 9.0), at(5.0, 2.0), at(1.0, 1.0)];
        assert_eq!(weighted_median(&lit, |lit| lit.radius), Some(2.0));
        assert_eq!(weighted_median(&[], |lit| lit.radius), None);
    }
}
