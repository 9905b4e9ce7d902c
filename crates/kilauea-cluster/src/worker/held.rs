//! The scene of a worker's last frame.

use std::sync::Arc;

use kilauea_render::{PrepareOptions, PreparedScene};
use kilauea_scene::Camera;

use crate::scene::scene_from_bytes;

/// A scene that is ready, for the next frame that needs the same.
pub(crate) struct Held {
    scene_hash: [u8; 32],
    options: PrepareOptions,
    pub(super) prepared: Arc<PreparedScene>,
}

impl Held {
    /// Prepares the scene of these bytes, whose hash is known.
    pub(super) fn prepare(
        bytes: Vec<u8>,
        scene_hash: [u8; 32],
        options: PrepareOptions,
    ) -> Result<Self, String> {
        let scene = scene_from_bytes(&bytes).map_err(|error| error.to_string())?;
        drop(bytes);
        let prepared = PreparedScene::new(scene, &options).map_err(|error| error.to_string())?;
        Ok(Self {
            scene_hash,
            options,
            prepared: Arc::new(prepared),
        })
    }

    /// Of the bytes that it was made of.
    pub(super) fn scene_hash(&self) -> [u8; 32] {
        self.scene_hash
    }

    /// The same for another frame, which takes no time to prepare.
    pub(super) fn again(mut self, options: PrepareOptions) -> Result<Self, String> {
        if self.options != options {
            return Err("a worker was to render a scene that it has prepared otherwise".into());
        }
        self.change(|prepared| prepared.build_secs = 0.0)?;
        Ok(self)
    }

    /// Has it seen from a camera.
    pub(super) fn set_camera(&mut self, camera: Camera) -> Result<(), String> {
        let set = self.change(|prepared| prepared.set_camera(camera))?;
        set.map_err(|error| error.to_string())
    }

    fn change<T>(&mut self, change: impl FnOnce(&mut PreparedScene) -> T) -> Result<T, String> {
        let prepared = Arc::get_mut(&mut self.prepared);
        let prepared = prepared.ok_or("internal error: the last frame is still being rendered")?;
        Ok(change(prepared))
    }
}
