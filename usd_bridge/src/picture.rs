use kilauea_film::{Image, ImageError, ImageMetadata, write_image_exr, write_png};
use kilauea_render::PreparedScene;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};

use crate::error::render_error;

/// Writes what a scene's camera sees to each output: as `.png`, or with all of its layers as `.exr`.
pub(crate) fn write_pictures(
    outputs: &[PathBuf],
    picture: &Image,
    prepared: &PreparedScene,
) -> PyResult<()> {
    let mut outputs = outputs.iter();
    let written = outputs.try_for_each(|output| write_picture(output, picture, prepared));
    written.map_err(render_error)
}

fn write_picture(
    output: &Path,
    picture: &Image,
    prepared: &PreparedScene,
) -> Result<(), ImageError> {
    if has_extension(output, "png") {
        return write_png(output, picture);
    }
    let metadata = ImageMetadata {
        origin_world: prepared.scene.origin_world,
        camera: Some(prepared.scene.camera.clone()),
        ..ImageMetadata::default()
    };
    write_image_exr(output, picture.clone(), &metadata)
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|found| found.eq_ignore_ascii_case(extension))
}
