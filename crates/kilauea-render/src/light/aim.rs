//! Light aimed where it is of use, as earlier photons found it: at what throws caustics (in place of the
//! projection maps of Jensen 1996), or at what lights the picture.
//!
//! Of light from finite sources, the direction decides what it meets, of light from infinity the
//! place. A share of either is left as it was, so that what no earlier photon met
//! is still found; the density of photons is that of the mixture.

use kilauea_gather::{Arrival, DirectionTree};
use kilauea_math::{Vec2, Vec3};

use super::light_choice::LightChoice;
use super::lit_box::LitBox;
use super::places::Places;

/// How the light of a photon left that is of use.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UsefulRay {
    /// Number of the light.
    pub(crate) light: u32,
    /// Unit direction in which it left.
    pub(crate) dir: Vec3,
    /// The first surface that it met.
    pub(crate) p_met: Vec3,
    /// Luminance of the photon's power, or of its share in what is looked for.
    pub(crate) luminance: f32,
    /// Density with which it was emitted.
    pub(crate) density: f32,
}

/// Where the light of a source goes.
#[derive(Clone, Debug)]
pub(super) enum Target {
    /// Wherever it shines.
    Anywhere,
    Directions(DirectionTree),
    Places(Places),
}

/// Of light, the share that is aimed.
const AIMED_SHARE: f32 = 0.75;
/// Of the choice among sources, the share that follows what earlier photons brought.
const CHOSEN_SHARE: f32 = 0.5;

impl Target {
    /// What light of one source met, whether that is at infinity or not.
    pub(super) fn of(rays: &[UsefulRay], is_infinite: bool) -> Self {
        let least = if is_infinite {
            UsefulRay::MIN_TO_BOUND
        } else {
            UsefulRay::MIN_TO_AIM
        };
        if rays.len() < least {
            return Self::Anywhere;
        }
        if is_infinite {
            return Places::of(rays).map_or(Self::Anywhere, Self::Places);
        }
        let arrivals: Vec<Arrival> = rays.iter().map(UsefulRay::arrival).collect();
        DirectionTree::fit(&arrivals).map_or(Self::Anywhere, Self::Directions)
    }

    /// A unit direction of a finite source with its density, which alone chooses by `sample` with
    /// the density `pdf`.
    pub(super) fn direction(
        &self,
        u: Vec2,
        sample: impl FnOnce(Vec2) -> Vec3,
        pdf: impl FnOnce(Vec3) -> f32,
    ) -> (Vec3, f32) {
        let dir = match self {
            Self::Directions(tree) => match aimed(u) {
                (true, u) => tree.sample(u),
                (false, u) => sample(u),
            },
            Self::Anywhere | Self::Places(_) => sample(u),
        };
        (dir, self.direction_pdf(dir, pdf(dir)))
    }

    /// The density of [`Self::direction`] where that of the source alone is `pdf`.
    pub(super) fn direction_pdf(&self, dir: Vec3, pdf: f32) -> f32 {
        match self {
            Self::Directions(tree) => mixed(tree.pdf(dir), pdf),
            Self::Anywhere | Self::Places(_) => pdf,
        }
    }

    /// Where light from infinity along the unit vector `dir` enters the box around all surfaces, and
    /// the density of that per area.
    pub(super) fn entry(&self, lit: &LitBox, dir: Vec3, u: Vec2) -> (Vec3, f32) {
        let p = match self {
            Self::Places(places) => match aimed(u) {
                (true, u) => lit.entry_of(places.entry(dir, u), dir),
                (false, u) => lit.entry(dir, u),
            },
            Self::Anywhere | Self::Directions(_) => lit.entry(dir, u),
        };
        (p, self.density_per_area(lit, p, dir))
    }

    /// The density of [`Self::entry`] for the line through `p`.
    pub(super) fn density_per_area(&self, lit: &LitBox, p: Vec3, dir: Vec3) -> f32 {
        let anywhere = 1.0 / lit.cross_section(dir);
        match self {
            Self::Places(places) => mixed(places.density_per_area(p, dir), anywhere),
            Self::Anywhere | Self::Directions(_) => anywhere,
        }
    }
}

impl UsefulRay {
    /// Fewer do not tell where to aim the light of their source.
    pub(crate) const MIN_TO_AIM: usize = 16;
    /// Fewer do not tell around what light from infinity is aimed.
    pub(crate) const MIN_TO_BOUND: usize = 4;

    /// The ray as light that arrives from where it goes to.
    fn arrival(&self) -> Arrival {
        Arrival {
            wi: self.dir,
            irradiance: self.luminance,
            pdf: self.density,
        }
    }
}

/// A choice among lights that is drawn toward those whose light is of use; `source` is which
/// of so many sources a light belongs to.
pub(super) fn choice_by_use(
    choice: &LightChoice,
    n_lights: u32,
    n_sources: usize,
    source: impl Fn(u32) -> usize,
    rays: &[UsefulRay],
) -> LightChoice {
    let probabilities = (0..n_lights).map(|light| (source(light), choice.probability(light)));
    let emitted = shares(n_sources, probabilities);
    let brought = shares(
        n_sources,
        rays.iter().map(|ray| (source(ray.light), ray.luminance)),
    );
    LightChoice::new((0..n_lights).map(|light| {
        let source = source(light);
        let gain = if emitted[source] > 0.0 {
            (brought[source] / emitted[source]) as f32
        } else {
            0.0
        };
        choice.probability(light) * (1.0 - CHOSEN_SHARE + CHOSEN_SHARE * gain)
    }))
}

/// The share that each of so many sources has in the sum of all values.
fn shares(n_sources: usize, values: impl Iterator<Item = (usize, f32)>) -> Vec<f64> {
    let mut shares = vec![0.0; n_sources];
    let mut total = 0.0;
    for (source, value) in values {
        shares[source] += f64::from(value);
        total += f64::from(value);
    }
    for share in &mut shares {
        *share = if total > 0.0 { *share / total } else { 0.0 };
    }
    shares
}

/// Whether light is aimed, and what that choice leaves of the random numbers.
fn aimed(u: Vec2) -> (bool, Vec2) {
    let is_aimed = u.x < AIMED_SHARE;
    let x = if is_aimed {
        u.x / AIMED_SHARE
    } else {
        (u.x - AIMED_SHARE) / (1.0 - AIMED_SHARE)
    };
    (is_aimed, Vec2::new(x.min(1.0 - 0.5 * f32::EPSILON), u.y))
}

fn mixed(aimed: f32, anywhere: f32) -> f32 {
    AIMED_SHARE * aimed + (1.0 - AIMED_SHARE) * anywhere
}
