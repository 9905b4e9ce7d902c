use std::collections::BTreeMap;

use kilauea_bsdf::{Bsdf, BsdfEval, BsdfSample};
use kilauea_math::{Spectrum, Vec2, Vec3, warp};

use crate::{Comparison, Directions, Draw, Moments, compare, integrate_over, uniforms};

/// Directions drawn for each test.
const N_DRAWS: u32 = 20_000;
/// Half of the chart of directions is this close to the mirror direction, in radians: of the lobes
/// of all roughnesses, none is smaller than a cell.
const LOBE_ANGLE: f64 = 0.2;
/// Error of what is scattered into a cell.
const CELL_TOLERANCE: f64 = 3e-6;
/// Of the sum of all cells.
const QUADRATURE_ERROR: f64 = 3e-4;

/// What tests ask of a BSDF. They plant faults by putting something else in its place.
pub trait Scatters {
    /// See [`kilauea_bsdf::SeenBsdf::sample`].
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample>;

    /// See [`kilauea_bsdf::SeenBsdf::eval`].
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval;
}

impl Scatters for Bsdf {
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        self.seen_from(wo).sample(u)
    }

    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        self.seen_from(wo).eval(wi)
    }
}

/// A BSDF seen from one direction.
#[derive(Clone, Copy, Debug)]
pub struct Viewed<'a, B> {
    /// The BSDF.
    pub bsdf: &'a B,
    /// Where it is seen from.
    pub wo: Vec3,
    /// The normal about which it mirrors, on either side.
    pub n: Vec3,
}

impl<B: Scatters> Viewed<'_, B> {
    /// Directions that are drawn against their density; delta lobes against their probabilities.
    pub fn compare_density(&self, stream: u32) -> Comparison {
        let draw = |i| match self.bsdf.sample(self.wo, uniforms(stream, i)) {
            None => Draw::Lost,
            Some(s) if s.is_delta => Draw::Atom {
                idx: lobe(&s),
                probability: f64::from(s.pdf),
            },
            Some(s) => Draw::At(s.wi),
        };
        let density = |wi| f64::from(self.bsdf.eval(self.wo, wi).pdf);
        compare(&self.directions(), N_DRAWS, draw, density)
    }

    /// How often the light that draws scatter of a white environment, delta lobes aside, would be
    /// as far from `expected`. With [`Self::smooth_albedo`] it holds f cos / pdf to f and pdf.
    pub fn draws_p_value(&self, expected: f64, stream: u32) -> f64 {
        let scattered = |i| {
            let sample = self.bsdf.sample(self.wo, uniforms(stream, i));
            let smooth = sample.filter(|s| !s.is_delta);
            smooth.map_or(0.0, |s| project(s.weight()))
        };
        let draws: Vec<f64> = (0..N_DRAWS).map(scattered).collect();
        Moments::of(&draws).p_value(expected, QUADRATURE_ERROR)
    }

    /// What is scattered of a white environment: the integral of the value, and all delta lobes.
    pub fn albedo(&self) -> f64 {
        self.smooth_albedo() + self.delta_albedo()
    }

    /// The integral of the value.
    pub fn smooth_albedo(&self) -> f64 {
        let scattered = |wi| project(self.bsdf.eval(self.wo, wi).total());
        integrate_over(&self.directions(), CELL_TOLERANCE, scattered)
    }

    /// What all delta lobes scatter; they are as many as evenly spaced choices of a lobe show.
    pub fn delta_albedo(&self) -> f64 {
        const N_CHOICES: u32 = 2048;
        let choices = (0..N_CHOICES).map(|i| (i as f32 + 0.5) / N_CHOICES as f32);
        let lobes: BTreeMap<u32, f64> = choices
            .filter_map(|u| self.bsdf.sample(self.wo, [u, 0.5, 0.5]))
            .filter(|s| s.is_delta)
            .map(|s| (lobe(&s), f64::from(s.pdf) * project(s.weight())))
            .collect();
        lobes.into_values().sum()
    }

    fn directions(&self) -> Directions {
        let mirrored = 2.0 * self.wo.dot(self.n) * self.n - self.wo;
        Directions::around(mirrored, LOBE_ANGLE)
    }
}

/// Tells delta lobes apart: no two are chosen with the same probability.
fn lobe(sample: &BsdfSample) -> u32 {
    sample.pdf.to_bits()
}

/// Uneven weights, so that channels cannot stand in for each other. White is one.
pub fn project(light: Spectrum) -> f64 {
    let [r, g, b] = light.to_array().map(f64::from);
    0.5 * r + 0.3 * g + 0.2 * b
}

/// The share of the light of a white environment that would be scattered otherwise if it went the
/// other way; zero for what obeys Helmholtz reciprocity. Of the outside, with normal z, and without
/// delta lobes.
pub fn asymmetry(bsdf: &impl Scatters) -> f64 {
    let (mut scattered, mut differs) = (0.0, 0.0);
    for i in 0..N_DRAWS {
        let [x, y, choice, u, v] = uniforms(0, i);
        let wo = warp::cosine_hemisphere(Vec2::new(x, y));
        let Some(sample) = bsdf.sample(wo, [choice, u, v]) else {
            continue;
        };
        if sample.is_delta || wo.z <= 0.0 {
            continue;
        }
        let wi = sample.wi;
        let there = project(bsdf.eval(wo, wi).total()) / f64::from(wi.z);
        let back = project(bsdf.eval(wi, wo).total()) / f64::from(wo.z);
        let weight = project(sample.weight());
        scattered += weight;
        differs += weight * (1.0 - back / there).abs();
    }
    if scattered > 0.0 {
        differs / scattered
    } else {
        0.0
    }
}
