//! Photons as the camera sees them, for looking at.

use std::num::NonZeroUsize;

use kilauea_film::{Channel, Image};
use kilauea_math::{INV_PI, Spectrum};
use kilauea_photon::{DensityRule, Photon, PhotonClass, PhotonMap, RadiusRule, SurfaceQuery};
use rayon::prelude::*;

use super::importon::{Importon, ImportonRequest, trace_importons};
use crate::RenderError;
use crate::prepared::PreparedScene;

/// Photons that an estimate takes.
const N_NEAREST: NonZeroUsize = NonZeroUsize::new(64).expect("not zero");

/// What a pixel shows of photons.
#[derive(Clone, Copy, Default)]
struct PhotonPixel {
    /// What a diffuse surface sends to the camera.
    radiance: Spectrum,
    irradiance: Spectrum,
    caustic_irradiance: Spectrum,
    /// Photons within the pixel.
    count: f32,
    /// Of these, the watts.
    power: Spectrum,
}

/// The scene as photons light it, at the first rough surface in each pixel: `R`, `G`, `B` are the
/// radiance that the estimate gives of diffuse surfaces; `irradiance` and `caustic` are the estimates
/// in W/m² of all photons and of caustic ones; `photons.count` and `photons.R`, `photons.G`,
/// `photons.B` are how many lie within a pixel, and their watts.
///
/// # Errors
/// If a shader panics.
pub fn photon_picture(
    prepared: &PreparedScene,
    photons: &[Photon],
    resolution: [u32; 2],
    n_threads: usize,
) -> Result<Image, RenderError> {
    let request = ImportonRequest::of_pixels(resolution, n_threads);
    let importons = trace_importons(prepared, &request)?;
    let is_caustic = |p: &&Photon| matches!(p.class, PhotonClass::Caustic { .. });
    let caustic: Vec<Photon> = photons.iter().filter(is_caustic).copied().collect();
    let maps = [PhotonMap::build(photons), PhotonMap::build(&caustic)];
    let found: Vec<(u32, PhotonPixel)> = importons
        .par_iter()
        .map(|importon| (importon.block, PhotonPixel::at(importon, &maps)))
        .collect();
    let n_pixels = resolution[0] as usize * resolution[1] as usize;
    let mut pixels = vec![PhotonPixel::default(); n_pixels];
    for (block, pixel) in found {
        pixels[block as usize] = pixel;
    }
    Ok(image(&pixels, resolution))
}

impl PhotonPixel {
    fn at(importon: &Importon, [all, caustic]: &[PhotonMap; 2]) -> Self {
        let query = SurfaceQuery {
            p: importon.p,
            n: importon.n,
        };
        let radius = RadiusRule::Nearest {
            k: N_NEAREST,
            max_radius: f32::INFINITY,
        };
        let rule = DensityRule::default();
        let irradiance = all.irradiance_by(&query, radius, &rule).value;
        let mut pixel = Self {
            irradiance,
            caustic_irradiance: caustic.irradiance_by(&query, radius, &rule).value,
            radiance: importon.throughput * importon.albedo * irradiance * INV_PI,
            ..Self::default()
        };
        all.for_each_within(importon.p, 0.5 * importon.width, |photon, _| {
            pixel.count += 1.0;
            pixel.power += photon.power();
        });
        pixel
    }
}

fn image(pixels: &[PhotonPixel], resolution: [u32; 2]) -> Image {
    let mut channels = Vec::new();
    let mut add = |name: String, value: &dyn Fn(&PhotonPixel) -> f32| {
        let samples = pixels.iter().map(value).collect();
        channels.push(Channel { name, samples });
    };
    for (c, rgb) in ["R", "G", "B"].into_iter().enumerate() {
        add(rgb.to_owned(), &|p| p.radiance[c]);
        add(format!("caustic.{rgb}"), &|p| p.caustic_irradiance[c]);
        add(format!("irradiance.{rgb}"), &|p| p.irradiance[c]);
        add(format!("photons.{rgb}"), &|p| p.power[c]);
    }
    add("photons.count".to_owned(), &|p| p.count);
    Image::whole(resolution, channels)
}
