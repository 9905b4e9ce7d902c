//! The Python door: `kilauea._native`. Converts and calls; knows no USD and decides nothing.

#![forbid(unsafe_code)]
#![expect(
    clippy::needless_pass_by_value,
    reason = "PyO3 hands over what it extracted from Python"
)]

mod assembled;
mod build;
mod crew;
mod error;
mod estimates;
mod frame;
mod image;
mod job;
mod metrics;
mod photons;
mod picture;
mod rays;
mod scene;
mod shaders;
mod threads;
mod worker;

#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::assembled::{AssembledScene, build_hash};
    #[pymodule_export]
    use crate::build::{assemble_scene, build_scene};
    #[pymodule_export]
    use crate::crew::Crew;
    #[pymodule_export]
    use crate::error::{RenderError, SceneError};
    #[pymodule_export]
    use crate::estimates::inspect_estimates;
    #[pymodule_export]
    use crate::image::{compare, hdr_flip};
    #[pymodule_export]
    use crate::job::RenderJob;
    #[pymodule_export]
    use crate::metrics::MetricsServer;
    #[pymodule_export]
    use crate::photons::{inspect_photons, measure_photons};
    #[pymodule_export]
    use crate::rays::RayWorkload;
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::shaders::shader_declarations;
    #[pymodule_export]
    use crate::worker::{Worker, run_worker};
}
