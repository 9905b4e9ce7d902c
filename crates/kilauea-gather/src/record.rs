use kilauea_math::Vec3;

use crate::cell_tree::{Place, place};

/// Light that was found along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Unit direction from which it came.
    pub wi: Vec3,
    /// Estimate of the irradiance by it: `L |cos θ| / pdf` in luminance; 0 where no light came.
    pub irradiance: f32,
    /// Density per solid angle with which `wi` was drawn.
    pub pdf: f32,
}

/// What a path learnt where it scattered, once it had ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherRecord {
    /// Where it scattered, engine space.
    pub p: Vec3,
    /// Unit shading normal on the side that is seen.
    pub n: Vec3,
    /// What it found by going on.
    pub arrival: Arrival,
    /// Column and row of its pixel.
    pub pixel: [i32; 2],
    /// Luminance that the pixel got of what it found.
    pub brought: f32,
}

impl Arrival {
    /// Whether it says anything: no NaN, no infinity, nothing negative.
    pub(crate) fn is_sound(&self) -> bool {
        self.wi.is_finite()
            && self.irradiance.is_finite()
            && self.irradiance >= 0.0
            && self.pdf.is_finite()
            && self.pdf > 0.0
    }
}

impl GatherRecord {
    /// As [`Arrival::is_sound`].
    pub(crate) fn is_sound(&self) -> bool {
        self.arrival.is_sound()
            && self.p.is_finite()
            && self.n.is_finite()
            && self.brought.is_finite()
    }
    /// Those of `records` that say anything.
    pub(crate) fn sound(records: &[Self]) -> Vec<Self> {
        let sound = records.iter().filter(|record| record.is_sound());
        sound.copied().collect()
    }

    /// Where records are, for cells.
    pub(crate) fn places(records: &[Self]) -> Vec<Place> {
        records.iter().map(|r| place(r.p, r.n)).collect()
    }
}
