use std::collections::BTreeMap;

use kilauea_film::Image;
use serde::Serialize;

use super::GatherEstimate;
use crate::prepared::PreparedScene;
use crate::stats::GatherStats;

/// What paths are told, in figures.
#[derive(Clone, Debug, Serialize)]
pub struct EstimateReport {
    /// What the pilot found.
    pub gather: GatherStats,
    /// By prim: in how many pixels one of its lights is the likeliest.
    pub lights: BTreeMap<String, u64>,
    /// What paths are not told, and why.
    pub skipped: Vec<String>,
}

impl EstimateReport {
    /// Of estimates and their picture, if there is one.
    pub fn of(
        prepared: &PreparedScene,
        estimate: &GatherEstimate,
        picture: Option<&Image>,
    ) -> Self {
        let PreparedScene {
            scene,
            geometry,
            lights,
            ..
        } = prepared;
        let mut pixels_of = BTreeMap::new();
        let top = picture.and_then(|picture| picture.channel("lights.top"));
        for &light in top
            .unwrap_or_default()
            .iter()
            .filter(|&&light| light >= 0.0)
        {
            let path = lights.prim_path(light as u32, scene, geometry);
            *pixels_of.entry(path.to_owned()).or_default() += 1;
        }
        Self {
            gather: estimate.found,
            lights: pixels_of,
            skipped: estimate.skipped(),
        }
    }
}
