//! Algorithms that turn a camera ray into radiance.

mod blame;
mod fault;
mod path;
mod question;
mod rays;
mod throughput;

pub(crate) use blame::Blame;
pub(crate) use fault::{Fault, Faults, FirstFault, SampleId, Step, Unwatched};
pub(crate) use path::{PathIntegrator, RayCounts};
pub(crate) use question::{Answer, Question};
pub(crate) use rays::RayTracer;
