//! What the pilot of a frame told, in a file, for whoever renders the same frame again.
//!
//! The file begins with [`MAGIC`] and the BLAKE3 of what follows: a record with names (MessagePack).

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use kilauea_render::GatherEstimate;
use kilauea_scene::{RenderSettings, Scene, Shading};
use serde::{Deserialize, Serialize};

use crate::handshake::build_hash;
use crate::scene::{camera_to_bytes, scene_to_bytes};

/// How such a file begins.
const MAGIC: &[u8; 8] = b"KLESTIM1";
const HASH_BYTES: usize = 32;

/// Why saved estimates cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum EstimatesError {
    /// The file cannot be read or written.
    #[error("{path}: {error}")]
    Io {
        /// The file.
        path: String,
        /// What went wrong.
        error: io::Error,
    },
    /// They would be of no use.
    #[error("{path} has the estimates of another {what}: make them anew with --save-estimates")]
    Other {
        /// The file.
        path: String,
        /// What is not the same.
        what: &'static str,
    },
    /// It is something else, or not whole.
    #[error("{path} has no estimates, or not all that were written")]
    Broken {
        /// The file.
        path: String,
    },
}

/// All that estimates depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EstimatesOf {
    build: u64,
    scene: [u8; HASH_BYTES],
    camera: [u8; HASH_BYTES],
    settings: [u8; HASH_BYTES],
}

#[derive(Serialize)]
struct SavedRef<'a> {
    of: EstimatesOf,
    estimate: &'a GatherEstimate,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    of: EstimatesOf,
    estimate: GatherEstimate,
}

impl EstimatesOf {
    /// Those of a scene, seen from `scene.camera`, with these settings, by this program.
    ///
    /// # Panics
    /// Never: all records can be written.
    pub fn frame(scene: &Scene, settings: &RenderSettings) -> Self {
        // A frame of them is the same however it is computed, and whatever layers it has.
        let settings = RenderSettings {
            threads: 0,
            time_limit_secs: None,
            aovs: Vec::new(),
            texture_memory_bytes: 0,
            shading: Shading::Inline,
            shade_memory_bytes: 0,
            ..settings.clone()
        };
        let settings = rmp_serde::to_vec_named(&settings).expect("settings can be written");
        Self {
            build: build_hash(),
            scene: *blake3::hash(&scene_to_bytes(scene)).as_bytes(),
            camera: *blake3::hash(&camera_to_bytes(&scene.camera)).as_bytes(),
            settings: *blake3::hash(&settings).as_bytes(),
        }
    }

    /// Those of the same frame with the settings of another.
    fn with_settings_of(self, other: &Self) -> Self {
        Self {
            settings: other.settings,
            ..self
        }
    }

    /// What is not the same, in a word.
    fn differs_from(&self, other: &Self) -> Option<&'static str> {
        let Self {
            build,
            scene,
            camera,
            settings,
        } = self;
        let differences = [
            (*build != other.build, "build of Kilauea"),
            (*scene != other.scene, "scene"),
            (*camera != other.camera, "camera"),
            (*settings != other.settings, "set of settings"),
        ];
        let mut differences = differences.into_iter();
        differences.find_map(|(differs, what)| differs.then_some(what))
    }
}

/// Writes estimates to a file, beside it at first, so that it is whole or as before.
///
/// # Errors
/// The file cannot be written.
///
/// # Panics
/// Never: all records can be written.
pub fn save_estimates(
    path: &Path,
    of: EstimatesOf,
    estimate: &GatherEstimate,
) -> Result<(), EstimatesError> {
    let saved = SavedRef { of, estimate };
    let body = rmp_serde::to_vec_named(&saved).expect("estimates can be written");
    let bytes = [&MAGIC[..], blake3::hash(&body).as_bytes(), &body].concat();
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    let beside = PathBuf::from(beside);
    let written = fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, path));
    written.map_err(|error| EstimatesError::Io {
        path: path.display().to_string(),
        error,
    })
}

/// Reads estimates from a file that has those of the same frame.
///
/// # Errors
/// The file cannot be read, is damaged, or has those of another frame.
pub fn load_estimates(path: &Path, of: &EstimatesOf) -> Result<GatherEstimate, EstimatesError> {
    load(path, |_| *of)
}

/// Reads estimates from a file to be looked at: those of a frame of the same scene, seen from the same
/// camera, with any settings.
///
/// # Errors
/// The file cannot be read, is damaged, or has those of another scene or camera.
pub fn load_estimates_of(path: &Path, scene: &Scene) -> Result<GatherEstimate, EstimatesError> {
    let of = EstimatesOf::frame(scene, &RenderSettings::default());
    load(path, |saved| of.with_settings_of(saved))
}

/// Reads estimates of what is `expected`, by what the file says that it has.
fn load(
    path: &Path,
    expected: impl Fn(&EstimatesOf) -> EstimatesOf,
) -> Result<GatherEstimate, EstimatesError> {
    let name = || path.display().to_string();
    let bytes = fs::read(path).map_err(|error| EstimatesError::Io {
        path: name(),
        error,
    })?;
    let saved = parse(&bytes).ok_or_else(|| EstimatesError::Broken { path: name() })?;
    match saved.of.differs_from(&expected(&saved.of)) {
        None => Ok(saved.estimate),
        Some(what) => Err(EstimatesError::Other { path: name(), what }),
    }
}

fn parse(bytes: &[u8]) -> Option<Saved> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (hash, body) = rest.split_at_checked(HASH_BYTES)?;
    if blake3::hash(body).as_bytes() != hash {
        return None;
    }
    rmp_serde::from_slice(body).ok()
}
