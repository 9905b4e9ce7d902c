//! Algorithms that turn a camera ray into radiance.

mod blame;
mod camera_media;
mod cone;
mod fault;
mod guide;
mod media;
mod merge;
mod path;
mod question;
mod rays;
mod roulette;
mod shade;
mod throughput;
mod walk;

pub(crate) use blame::Blame;
pub(crate) use camera_media::media_around;
pub(crate) use cone::RayCone;
pub(crate) use fault::{Fault, Faults, FirstFault, SampleId, Step, Unwatched};
pub(crate) use guide::{GUIDED_SHARE, Guide, Guided, PathTrail, Training, Unguided, light, n_rays};
pub(crate) use media::{Air, Boundary, Media, MediumStack};
pub(crate) use merge::{CausticMerge, Merge, Unmerged};
pub(crate) use path::{PathIntegrator, RayCounts};
pub(crate) use question::{Answer, Met, Question};
pub(crate) use rays::RayTracer;
