//! What a frame's paths are aimed at: small bright lights as surfaces see them in mirrors, through
//! glass and in highlights. By chance a path finds those too seldom, and is far too bright then.

use std::f64::consts::PI;
use std::time::Instant;

use kilauea_gather::{AimField, GatherRecord};
use kilauea_math::hash::combine;
use kilauea_scene::Aim;

use crate::RenderError;
use crate::frame::Frame;
use crate::light::{Emitter, UsefulRay};
use crate::needs::moves;
use crate::photon::{PhotonRequest, TracedArrivals, trace_arrivals};
use crate::stats::AimStats;

/// Paths of light for each path of a frame.
const PHOTON_SHARE: f64 = 1.0 / 8.0;
/// Of these, those that are sent everywhere.
const PILOT_SHARE: f64 = 1.0 / 4.0;
/// Those of each round after that, which are sent where all rounds before found something. What arrives
/// of the last is aimed at.
const ROUND_SHARES: [f64; 4] = [0.1, 0.1, 0.15, 0.4];
/// A frame for which fewer were to be traced goes without.
const LEAST_PHOTONS: f64 = 4096.0;
/// More would only make cells smaller than they need be.
const MOST_PHOTONS: f64 = (1 << 18) as f64;
/// A light is looked for that would be at least so many times as bright as what the scene's mean
/// irradiance makes of white: others are large enough for paths to find them.
const LEAST_CONTRAST: f64 = 100.0;
/// Light is worth aiming at that by chance makes at least that variance of a sample, relative to white
/// surfaces under the mean irradiance: for less, other light loses more by the directions that it lacks.
const LEAST_VARIANCE: f64 = 8.0;
/// Apart from all seeds of pictures; rounds have those after it.
const PILOT_SEED: u32 = 0x6169_6d30;

impl Frame {
    /// Where paths are to be aimed at; none where nothing specular shows a small bright light.
    ///
    /// It depends on the scene and on what is asked of the whole picture, so that a part of it is as
    /// it is in the whole.
    pub(crate) fn find_aims(&self) -> Result<Option<AimField>, RenderError> {
        let (prepared, settings) = (&*self.prepared, &self.settings);
        let n_pixels = settings.resolution.map(f64::from).iter().product::<f64>();
        let n_asked = PHOTON_SHARE * n_pixels * f64::from(settings.samples_per_pixel);
        let (least_contrast, least_variance) = match settings.photons.aim {
            Aim::WherePays if n_asked >= LEAST_PHOTONS => (LEAST_CONTRAST, LEAST_VARIANCE),
            Aim::Always => (0.0, 0.0),
            Aim::WherePays | Aim::Never => return Ok(None),
        };
        if settings.max_depth < 2 || prepared.scene.prototypes.iter().any(moves) {
            return Ok(None);
        }
        let start = Instant::now();
        let n_photons = n_asked.clamp(LEAST_PHOTONS, MOST_PHOTONS);
        let request = |share: f64, seed| PhotonRequest {
            n_emitted: (share * n_photons) as u32,
            max_depth: settings.max_depth,
            seed: combine(settings.seed, seed),
            n_threads: self.n_threads,
            shading: settings.shading,
        };
        let emitter = Emitter::new(&prepared.lights, &prepared.geometry, &prepared.textures);
        // By Cauchy, what is convex has four times the area of its mean shadow.
        let area = 4.0 * f64::from(emitter.mean_cross_section());
        let pilot = trace_arrivals(
            prepared,
            &emitter,
            &request(PILOT_SHARE, PILOT_SEED),
            self.path_share(),
        )?;
        let least_radiance = least_contrast * pilot.sent_out / (area * PI);
        let (_, mut rays) = bright(&pilot, least_radiance);
        let mut traced = vec![pilot];
        let mut field = None;
        if rays.len() >= UsefulRay::MIN_TO_BOUND {
            let (mut arrivals, mut sent_out) = (Vec::new(), 0.0);
            for (round, share) in (1..).zip(ROUND_SHARES) {
                let emitter = emitter.aimed_by(&rays);
                let request = request(share, PILOT_SEED + round);
                let aimed = trace_arrivals(prepared, &emitter, &request, self.path_share())?;
                let (arrived, found) = bright(&aimed, least_radiance);
                (arrivals, sent_out) = (arrived, aimed.sent_out);
                rays.extend(found);
                traced.push(aimed);
            }
            let white = sent_out / (area * PI);
            if variance_by_chance(&arrivals, area) >= least_variance * white * white {
                field = AimField::fit(&arrivals);
            }
            self.lock_outcome().aim.arrivals = arrivals.len() as u64;
        }
        self.note_aims(&traced, field.as_ref(), start);
        Ok(field)
    }

    fn note_aims(&self, traced: &[TracedArrivals], field: Option<&AimField>, start: Instant) {
        let mut outcome = self.lock_outcome();
        for traced in traced {
            outcome.caustics.rays += traced.counts.rays;
            outcome.counts.invalid += traced.counts.invalid_rays;
            outcome.counts.in_too_many_media += traced.counts.in_too_many_media;
        }
        outcome.caustics.seconds += start.elapsed().as_secs_f64();
        outcome.aim = AimStats {
            emitted: traced.iter().map(|traced| traced.counts.emitted).sum(),
            cells: field.map_or(0, |field| field.n_cells() as u64),
            bytes: field.map_or(0, |field| field.n_bytes() as u64),
            ..outcome.aim
        };
    }
}

/// Variance of a sample of paths that find arriving light by chance, where all surfaces of that area
/// are white: light of the mean radiance C that they find with the brightness f has C f.
fn variance_by_chance(arrivals: &[GatherRecord], area: f64) -> f64 {
    let flux_times_radiance = |record: &GatherRecord| {
        let flux = f64::from(record.arrival.irradiance);
        flux * flux * f64::from(record.arrival.pdf)
    };
    arrivals.iter().map(flux_times_radiance).sum::<f64>() / (area * PI)
}

/// Arrivals of light of at least that radiance, and how it left.
fn bright(traced: &TracedArrivals, least_radiance: f64) -> (Vec<GatherRecord>, Vec<UsefulRay>) {
    let is_bright = |record: &GatherRecord| {
        let arrival = &record.arrival;
        f64::from(arrival.irradiance * arrival.pdf) >= least_radiance
    };
    let both = traced.arrivals.iter().zip(&traced.rays);
    both.filter(|(record, _)| is_bright(record)).unzip()
}
