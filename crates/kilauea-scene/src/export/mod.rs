//! A scene as files that other renderers can read: `scene.json` and raw little-endian arrays.

mod arrays;

use std::fs;
use std::io;
use std::path::Path;

use serde_json::json;

use crate::{RenderSettings, Scene};
use arrays::ArrayWriter;

impl Scene {
    /// Writes the scene into an existing folder. `scene.json` holds the records of this crate as
    /// serde writes them, and names the files of the arrays: `f32` and `u32` as in
    /// [`crate::MeshChunk`], [`crate::CurvesChunk`] and [`crate::PointsChunk`], matrices as 16 `f64`
    /// each, column after column.
    pub fn export(&self, folder: &Path, settings: &RenderSettings) -> io::Result<()> {
        let mut arrays = ArrayWriter::new(folder);
        let mut prototypes = Vec::new();
        for prototype in &self.prototypes {
            prototypes.push(json!({
                "path": prototype.path,
                "center": prototype.center,
                "chunks": arrays.list(&prototype.chunks, ArrayWriter::mesh)?,
                "curves": arrays.list(&prototype.curves, ArrayWriter::curves)?,
                "points": arrays.list(&prototype.points, ArrayWriter::points)?,
                "instances": arrays.list(&prototype.instances, ArrayWriter::instances)?,
            }));
        }
        let scene = json!({
            "origin_world": self.origin_world,
            "prim_paths": self.prim_paths,
            "prototypes": prototypes,
            "materials": self.materials,
            "textures": self.textures,
            "lights": self.lights,
            "camera": self.camera,
            "settings": settings,
        });
        fs::write(
            folder.join("scene.json"),
            serde_json::to_vec_pretty(&scene)?,
        )
    }
}
