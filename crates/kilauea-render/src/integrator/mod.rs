//! Algorithms that turn a camera ray into radiance.

mod path;

pub(crate) use path::{PathIntegrator, RayCounts};
