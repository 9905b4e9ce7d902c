//! What paths are told, as the camera sees it, for looking at.

use kilauea_film::{Channel, Image};
use kilauea_gather::{ChoiceField, GatherField, Lobe};
use kilauea_math::{Spectrum, Vec3};
use rayon::prelude::*;
use serde::Deserialize;

use super::GatherEstimate;
use crate::RenderError;
use crate::light::{ByCells, ByImportance, Lights, Receiver};
use crate::photon::{ImportonRequest, trace_importons};
use crate::prepared::PreparedScene;

/// What paths are told of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EstimateLayer {
    /// Which lights to choose.
    Lights,
    /// Where light comes from.
    Directions,
}

/// What lights paths choose at a place.
#[derive(Clone, Copy)]
struct LightPixel {
    cell: f32,
    /// Number of the likeliest light.
    top: f32,
    /// Its probability.
    probability: f32,
    /// The same where nothing is known.
    plain: f32,
    /// How many lights make up [`SHARE`].
    number: f32,
    /// Number of what the likeliest light is of.
    source: usize,
}

/// Where light comes from at a place.
#[derive(Clone, Copy)]
struct GuidePixel {
    cell: f32,
    mean: Vec3,
    peak: f32,
}

/// Of all choices: so many lights are counted as make it up.
const SHARE: f32 = 0.5;
/// Number where nothing rough is seen.
const NONE: f32 = -1.0;

/// What paths are told at the first rough surface in each pixel. `R`, `G`, `B` are a picture of what is
/// `shown`, or else of what they are told of. Lights: a hue for the prim of the likeliest, as bright as that is likely.
/// Directions: each component of the mean direction is a colour, and grey where light comes evenly.
///
/// Of lights, if paths are told of them: `lights.cell`, `lights.top`, the number of the likeliest light,
/// `lights.probability`, `lights.plain`, its probability where nothing is known, and `lights.number`, how
/// many lights make up half of all choices. Of directions: `guide.cell`, `guide.X`, `guide.Y`, `guide.Z`, the
/// mean direction, whose length says how alike all are, and `guide.peak`, the greatest density over that of
/// even directions.
///
/// None where paths are not told what is to be shown: see [`GatherEstimate::skipped`].
///
/// # Errors
/// If a shader panics.
pub fn estimate_picture(
    prepared: &PreparedScene,
    estimate: &GatherEstimate,
    resolution: [u32; 2],
    n_threads: usize,
    shown: Option<EstimateLayer>,
) -> Result<Option<Image>, RenderError> {
    let GatherEstimate {
        directions, lights, ..
    } = estimate;
    let shown = shown.unwrap_or(match lights {
        Some(_) => EstimateLayer::Lights,
        None => EstimateLayer::Directions,
    });
    let is_known = match shown {
        EstimateLayer::Lights => lights.is_some(),
        EstimateLayer::Directions => directions.is_some(),
    };
    if !is_known {
        return Ok(None);
    }
    let receivers = receivers(prepared, resolution, n_threads)?;
    let mut channels = Vec::new();
    if let Some(field) = lights {
        let at = |&receiver: &Receiver| LightPixel::at(field, &prepared.lights, receiver);
        let pixels = each(&receivers, at, LightPixel::NOTHING);
        let is_shown = shown == EstimateLayer::Lights;
        add_layers(
            &mut channels,
            &pixels,
            &LightPixel::LAYERS,
            is_shown.then_some(LightPixel::color),
        );
    }
    if let Some(field) = directions {
        let at = |&receiver: &Receiver| GuidePixel::at(field, receiver);
        let pixels = each(&receivers, at, GuidePixel::NOTHING);
        let is_shown = shown == EstimateLayer::Directions;
        add_layers(
            &mut channels,
            &pixels,
            &GuidePixel::LAYERS,
            is_shown.then_some(GuidePixel::color),
        );
    }
    Ok(Some(Image::whole(resolution, channels)))
}

/// The first rough surface in each pixel, if there is one.
fn receivers(
    prepared: &PreparedScene,
    resolution: [u32; 2],
    n_threads: usize,
) -> Result<Vec<Option<Receiver>>, RenderError> {
    let request = ImportonRequest::of_pixels(resolution, n_threads);
    let n_pixels = resolution[0] as usize * resolution[1] as usize;
    let mut receivers = vec![None; n_pixels];
    for importon in trace_importons(prepared, &request)? {
        receivers[importon.block as usize] = Some(Receiver {
            p: importon.p,
            n: importon.n_shading,
        });
    }
    Ok(receivers)
}

fn each<T: Copy + Send + Sync>(
    receivers: &[Option<Receiver>],
    at: impl Fn(&Receiver) -> T + Sync,
    nothing: T,
) -> Vec<T> {
    let at = |receiver: &Option<Receiver>| receiver.as_ref().map_or(nothing, &at);
    receivers.par_iter().map(at).collect()
}

/// A layer's name, and its value.
type Layer<T> = (&'static str, fn(&T) -> f32);

fn add_layers<T>(
    channels: &mut Vec<Channel>,
    pixels: &[T],
    layers: &[Layer<T>],
    color: Option<fn(&T) -> Spectrum>,
) {
    let mut add = |name: &str, value: &dyn Fn(&T) -> f32| {
        let samples = pixels.iter().map(value).collect();
        let name = name.to_owned();
        channels.push(Channel { name, samples });
    };
    for (name, value) in layers {
        add(name, value);
    }
    if let Some(color) = color {
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            add(name, &|pixel| color(pixel)[c]);
        }
    }
}

impl LightPixel {
    const NOTHING: Self = Self {
        cell: NONE,
        top: NONE,
        probability: 0.0,
        plain: 0.0,
        number: 0.0,
        source: 0,
    };
    const LAYERS: [Layer<Self>; 5] = [
        ("lights.cell", |pixel| pixel.cell),
        ("lights.top", |pixel| pixel.top),
        ("lights.probability", |pixel| pixel.probability),
        ("lights.plain", |pixel| pixel.plain),
        ("lights.number", |pixel| pixel.number),
    ];

    fn at(field: &ChoiceField, lights: &Lights, receiver: Receiver) -> Self {
        let by_cells = ByCells { field: Some(field) };
        let likeliest = lights.likeliest(receiver, by_cells, SHARE);
        let cell = field.cell(receiver.p, receiver.n) as f32;
        match likeliest.first() {
            None => Self {
                cell,
                ..Self::NOTHING
            },
            Some(top) => Self {
                cell,
                top: top.light as f32,
                probability: top.probability,
                plain: lights.probability(top.light, receiver, ByImportance),
                number: likeliest.len() as f32,
                source: lights.source(top.light),
            },
        }
    }

    fn color(&self) -> Spectrum {
        /// Turns of the hue from one light to the next, by which those of consecutive numbers differ.
        const GOLDEN: f32 = 0.618_034;
        let hue = 6.0 * (self.source as f32 * GOLDEN).rem_euclid(1.0);
        let [red, green, blue] = [0.0, 4.0, 2.0].map(|shift| {
            let turned = (hue + shift).rem_euclid(6.0);
            ((turned - 3.0).abs() - 1.0).clamp(0.0, 1.0)
        });
        Spectrum::new(red, green, blue) * self.probability
    }
}

impl GuidePixel {
    const NOTHING: Self = Self {
        cell: NONE,
        mean: Vec3::ZERO,
        peak: 0.0,
    };
    const LAYERS: [Layer<Self>; 5] = [
        ("guide.cell", |pixel| pixel.cell),
        ("guide.X", |pixel| pixel.mean.x),
        ("guide.Y", |pixel| pixel.mean.y),
        ("guide.Z", |pixel| pixel.mean.z),
        ("guide.peak", |pixel| pixel.peak),
    ];

    fn at(field: &GatherField, receiver: Receiver) -> Self {
        let Receiver { p, n } = receiver;
        let cell = field.cell(p, n) as f32;
        match field.directions(p, n) {
            None => Self {
                cell,
                ..Self::NOTHING
            },
            Some(directions) => {
                let Lobe { mean, peak } = directions.lobe();
                Self { cell, mean, peak }
            }
        }
    }

    fn color(&self) -> Spectrum {
        if self.peak == 0.0 {
            return Spectrum::BLACK;
        }
        let Vec3 { x, y, z } = 0.5 * self.mean + 0.5;
        Spectrum::new(x, y, z)
    }
}
