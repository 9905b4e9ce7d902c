//! Algorithms that turn a camera ray into radiance.

mod blame;
mod camera_media;
mod cone;
mod fault;
mod guide;
mod media;
mod merge;
mod path;
mod path_light;
mod path_sample;
mod question;
mod ray_counts;
mod rays;
mod roulette;
mod shade;
mod throughput;
mod tiles;
mod walk;

pub(crate) use blame::Blame;
pub(crate) use camera_media::media_around;
pub(crate) use cone::RayCone;
pub(crate) use fault::{Fault, Faults, FirstFault, SampleId, Step, Unwatched};
pub(crate) use guide::{
    Aimed, GUIDED_SHARE, Guide, Guided, LightGuided, MIN_GUIDED_ROUGHNESS, Notes, PathTrail,
    Training, Unguided, n_rays,
};
pub(crate) use media::{Air, Boundary, Media, MediumStack};
pub(crate) use merge::{
    ArrivingPhoton, CausticMerge, FinalGather, Gathering, LightPdfs, LightTracing, MIN_PEAK, Merge,
    N_WORDS, PhotonSource, PhotonsOfSet, SeenVertex, SplatShares, Unmerged,
};
pub(crate) use path::PathIntegrator;
pub(crate) use path_sample::PathSample;
pub(crate) use question::{Answer, Met, PhotonQuestion, Question};
pub(crate) use ray_counts::{RayCounts, RayTally};
pub(crate) use rays::RayTracer;
#[cfg(test)]
pub(crate) use walk::power_heuristic;
