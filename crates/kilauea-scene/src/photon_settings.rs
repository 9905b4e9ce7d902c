use serde::{Deserialize, Serialize};

/// What is found by photons. All is chosen by the renderer unless said here (tests,
/// benchmarks).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PhotonSettings {
    /// Paths that lights send out for each sample that the pixels get.
    pub emitted_per_sample: Option<u32>,
    /// How far photons are merged with in the first sample, in scene units; less in later ones. Given, photons
    /// are traced whether they pay or not.
    pub radius: Option<f32>,
    /// By whom caustics are found.
    pub found_by: CausticStrategy,
    /// Whether paths are aimed at small bright lights in mirrors and behind glass, where photons found
    /// them.
    pub aim: Aim,
    /// Whether paths look irradiance up at their second rough vertex.
    pub final_gathering: FinalGathering,
    /// Whether each member of a set keeps a part of the caustic photons, and asks the others for theirs.
    pub split: PhotonSplit,
}

/// When the photons of a map are divided among the members of a set. The picture is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PhotonSplit {
    /// Where the map does not fit in the memory that a member has left.
    #[default]
    WhereNeeded,
    /// In any set.
    Always,
    /// Not at all.
    Never,
}

/// When paths look irradiance up that is known from photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FinalGathering {
    /// Where a trial says so.
    #[default]
    WherePays,
    /// In any frame where it is possible.
    Always,
    /// Not at all.
    Never,
}

/// When paths are aimed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aim {
    /// In frames of many samples, at lights that are small and bright.
    #[default]
    WherePays,
    /// In any frame, at any light.
    Always,
    /// Not at all.
    Never,
}

/// Ways to find caustics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CausticStrategy {
    /// By all below, each as far as it finds them better than the others.
    #[default]
    All,
    /// By photons alone.
    Photons,
    /// By paths from the camera alone.
    Paths,
}
