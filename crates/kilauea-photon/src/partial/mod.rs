//! One photon map in several parts, each of which sees its share of the photons alone.
//!
//! A map too large for one machine is split: photons go to parts at random, and a look-up asks all
//! of them. Three ways to make one irradiance of their answers:
//!
//! | | unequal shares | sent for a look-up |
//! |---|---|---|
//! | [`published`] (Kato and Saito 2002) | too low | one sum and one radius a part |
//! | [`common_radius`] | exact | one sum a part |
//! | [`merged`], [`merged_in_rounds`] | exact, the same photons as from one map | K photons a part, or about K / M |
//!
//! Shares are unequal when parts are given different numbers of paths, split by light or by place, or
//! when one is late.

mod common_radius;
mod merged;
mod published;

use std::num::NonZeroUsize;

pub use common_radius::common_radius;
pub use merged::{Merged, merged, merged_in_rounds};
pub use published::published;

use crate::{DensityRule, Irradiance, NearPhoton, PhotonMap, SurfaceQuery};

/// A part of a photon map, here or elsewhere.
pub trait PartialMap {
    /// Its `k` nearest photons that the rule accepts, at most `max_radius` away, nearest first.
    fn nearest(
        &self,
        query: &SurfaceQuery,
        k: NonZeroUsize,
        max_radius: f32,
        rule: &DensityRule,
    ) -> Vec<NearPhoton>;

    /// The irradiance of its photons within `radius`.
    fn within(&self, query: &SurfaceQuery, radius: f32, rule: &DensityRule) -> Irradiance;
}

impl PartialMap for PhotonMap {
    fn nearest(
        &self,
        query: &SurfaceQuery,
        k: NonZeroUsize,
        max_radius: f32,
        rule: &DensityRule,
    ) -> Vec<NearPhoton> {
        self.nearest_on_surface(query, k, max_radius, rule)
    }

    fn within(&self, query: &SurfaceQuery, radius: f32, rule: &DensityRule) -> Irradiance {
        self.irradiance(query, radius, rule)
    }
}

/// Which way to ask and combine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Combination {
    /// See [`published`].
    Published {
        /// Photons in all.
        k: NonZeroUsize,
        /// In metres.
        max_radius: f32,
    },
    /// See [`common_radius`].
    CommonRadius {
        /// In metres.
        radius: f32,
    },
    /// See [`merged`].
    Merged {
        /// Photons in all.
        k: NonZeroUsize,
        /// In metres.
        max_radius: f32,
    },
    /// See [`merged_in_rounds`].
    MergedInRounds {
        /// Photons in all.
        k: NonZeroUsize,
        /// In metres.
        max_radius: f32,
    },
}

impl Combination {
    /// Irradiance at a place from all parts.
    pub fn irradiance<P: PartialMap>(
        self,
        parts: &[P],
        query: &SurfaceQuery,
        rule: &DensityRule,
    ) -> Irradiance {
        match self {
            Self::Published { k, max_radius } => published(parts, query, k, max_radius, rule),
            Self::CommonRadius { radius } => common_radius(parts, query, radius, rule),
            Self::Merged { k, max_radius } => merged(parts, query, k, max_radius, rule).irradiance,
            Self::MergedInRounds { k, max_radius } => {
                merged_in_rounds(parts, query, k, max_radius, rule).irradiance
            }
        }
    }
}
