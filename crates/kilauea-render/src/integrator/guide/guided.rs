//! Directions from a mixture of what the surface scatters and where light came from before
//! (Vorba et al. 2014, "On-line Learning of Parametric Mixture Models for Light Transport
//! Simulation"; Müller, Gross & Novák 2017, "Practical Path Guiding").

use kilauea_bsdf::{BsdfSample, SeenBsdf};
use kilauea_gather::{ChoiceField, Directions, GatherField};
use kilauea_math::{Vec2, Vec3};

use super::aimed::{Aimed, AimedTrail};
use super::{Drawn, Guide, Knowledge};
use crate::light::{ByCells, CellWalk, LightChooser, Receiver};

/// Knows where light comes from in each cell, at what to aim, and which lights bring light.
#[derive(Clone, Copy)]
pub(crate) struct Guided<'a> {
    /// None where directions are left to the BSDF and to aims.
    pub(crate) field: Option<&'a GatherField>,
    /// They come before what is known of cells: what is aimed at, cells have not seen.
    pub(crate) aims: Option<Aimed<'a>>,
    pub(crate) lights: ByCells<'a>,
}

/// What is known at one place.
#[derive(Clone, Copy)]
pub(crate) struct Known<'a> {
    directions: Option<Directions<'a>>,
    /// Fraction of directions drawn from them, where all lobes are rough.
    share: f32,
}

/// Fraction of directions drawn from the cell, where all lobes are rough.
pub(crate) const GUIDED_SHARE: f32 = 0.5;
/// Smoother lobes know better than a cell where their light comes from.
pub(crate) const MIN_GUIDED_ROUGHNESS: f32 = 0.25;

impl<'a> LightChooser for Guided<'a> {
    type Walk = CellWalk<'a>;

    #[inline]
    fn walk(&self, receiver: Receiver) -> CellWalk<'a> {
        self.lights.walk(receiver)
    }
}

impl<'a> Guide for Guided<'a> {
    type Knowledge = Known<'a>;
    /// None where nothing is aimed.
    type Trail = Option<AimedTrail>;

    #[inline]
    fn set_out(&self, trail: &mut Self::Trail) {
        *trail = self.aims.map(|_| AimedTrail::default());
    }

    #[inline]
    fn undimmed(trail: &mut Self::Trail, drawn: &Drawn) -> f32 {
        match trail {
            Some(trail) => Aimed::undimmed(trail, drawn),
            None => 1.0,
        }
    }

    #[inline]
    fn at(&self, receiver: Receiver) -> Known<'a> {
        let Receiver { p, n } = receiver;
        let aims = self.aims.map(|aims| aims.field.directions(p, n));
        let found = self.field.and_then(|field| field.directions(p, n));
        match (aims, found) {
            // Of what the cell has not seen, the region is left.
            (Some(aims), Some(found)) if aims.near.is_none() => {
                let both = Directions {
                    near: Some(found),
                    ..aims
                };
                Known::new(Some(both), GUIDED_SHARE)
            }
            (Some(aims), _) => Aimed::know(aims),
            (None, found) => Known::new(found.map(Directions::around), GUIDED_SHARE),
        }
    }
}

impl<'a> Guided<'a> {
    const BLIND: Self = Self {
        field: None,
        aims: None,
        lights: ByCells::BLIND,
    };

    /// Knows directions alone.
    pub(crate) fn by_directions(field: &'a GatherField) -> Self {
        Self {
            field: Some(field),
            ..Self::BLIND
        }
    }

    /// Knows lights alone.
    pub(crate) fn by_lights(field: &'a ChoiceField) -> Self {
        Self {
            lights: ByCells { field: Some(field) },
            ..Self::BLIND
        }
    }
}

impl<'a> Known<'a> {
    pub(super) const NOTHING: Self = Self::new(None, 0.0);

    pub(super) const fn new(directions: Option<Directions<'a>>, share: f32) -> Self {
        Self { directions, share }
    }

    /// The distribution, and the fraction of directions to draw from it.
    #[inline]
    fn directions(&self, bsdf: &SeenBsdf) -> Option<(&Directions<'a>, f32)> {
        let directions = self.directions.as_ref()?;
        let share = self.share * bsdf.probability_of_rough(MIN_GUIDED_ROUGHNESS);
        (share > 0.0).then_some((directions, share))
    }
}

impl Knowledge for Known<'_> {
    #[inline]
    fn chooses_directions(&self) -> bool {
        self.directions.is_some()
    }

    #[inline]
    fn sample(&self, bsdf: &SeenBsdf, u: [f32; 3]) -> Option<Drawn> {
        let Some((directions, share)) = self.directions(bsdf) else {
            return bsdf.sample(u).map(Drawn::by_bsdf);
        };
        if u[0] < share {
            return sample_cell(directions, share, bsdf, Vec2::new(u[1], u[2]));
        }
        let u_lobe = ((u[0] - share) / (1.0 - share)).min(1.0 - 0.5 * f32::EPSILON);
        let sample = bsdf.sample([u_lobe, u[1], u[2]])?;
        let by_bsdf = (1.0 - share) * sample.pdf;
        let pdf = if sample.is_delta {
            by_bsdf
        } else {
            by_bsdf + share * directions.pdf(sample.wi)
        };
        let weight = sample.pdf / pdf;
        Some(Drawn {
            sample: BsdfSample {
                diffuse: sample.diffuse * weight,
                specular: sample.specular * weight,
                pdf,
                ..sample
            },
            density_ratio: pdf / sample.pdf,
        })
    }

    #[inline]
    fn pdf(&self, bsdf: &SeenBsdf, wi: Vec3, bsdf_pdf: f32) -> f32 {
        match self.directions(bsdf) {
            Some((directions, share)) => (1.0 - share) * bsdf_pdf + share * directions.pdf(wi),
            None => bsdf_pdf,
        }
    }
}

/// Draws a direction from the cell, and weighs it for the mixture.
#[inline]
fn sample_cell(directions: &Directions<'_>, share: f32, bsdf: &SeenBsdf, u: Vec2) -> Option<Drawn> {
    let wi = directions.sample(u);
    let eval = bsdf.eval(wi);
    if eval.total().is_black() {
        return None;
    }
    let pdf = (1.0 - share) * eval.pdf + share * directions.pdf(wi);
    let is_diffuse = !eval.diffuse.is_black();
    let sample = BsdfSample {
        wi,
        diffuse: eval.diffuse / pdf,
        specular: eval.specular / pdf,
        pdf,
        is_delta: false,
        is_transmission: false,
        is_diffuse,
        roughness: if is_diffuse {
            1.0
        } else {
            MIN_GUIDED_ROUGHNESS
        },
    };
    Some(Drawn {
        sample,
        density_ratio: pdf / eval.pdf,
    })
}
