use kilauea_film::{ImageError, UnknownAov};
use kilauea_scene::SceneError;
use kilauea_shading::ShaderError;
use kilauea_spot::RunError;

use crate::geometry::Geometry;
use crate::integrator::Blame;
use crate::set::PlacementError;

/// Why a frame cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The scene breaks one of its own rules.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A material cannot be shaded.
    #[error(transparent)]
    Shader(#[from] ShaderError),
    /// An image cannot be written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A layer that we do not have.
    #[error(transparent)]
    Aov(#[from] UnknownAov),
    /// A setting out of range.
    #[error("setting {name} is {value}: {reason}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        reason: &'static str,
    },
    /// The scene cannot be spread over the members of a set.
    #[error(transparent)]
    Placement(#[from] PlacementError),
    /// A part of a scene, and what is said of the whole, do not go together.
    #[error("what is known of the whole scene is of another one than this part")]
    OtherScene,
    /// A shader died of a bug.
    #[error("internal error in the shader of {material}: {message}")]
    ShaderPanicked {
        /// Path of the material.
        material: String,
        /// The message of the panic.
        message: String,
    },
    /// An engine thread died of a bug.
    #[error("internal error while rendering: {0}")]
    Panic(String),
}

impl RenderError {
    /// What a failed run of the engine means, with the shader that is to blame if one is.
    pub(crate) fn of_run(error: RunError, blame: &Blame, geometry: &Geometry) -> Self {
        let material = blame
            .surface()
            .map(|at| geometry.material_path(at).to_owned());
        match (error, material) {
            (
                RunError::Panicked { message, .. } | RunError::ThreadPanicked { message, .. },
                Some(material),
            ) => Self::ShaderPanicked { material, message },
            (error, _) => Self::Panic(error.to_string()),
        }
    }
}
