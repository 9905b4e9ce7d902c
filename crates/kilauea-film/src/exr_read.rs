use std::path::Path;

use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use kilauea_scene::DataWindow;

use crate::{Channel, Image, ImageError};

/// Reads a flat EXR file of any origin. The channels of a part with a name get it as a prefix
/// (`part.R`), unless they have it already or the file has only one part.
///
/// Parts whose data window differs from that of the first are an error; so are deep and
/// subsampled files.
pub fn read_exr(path: &Path) -> Result<Image, ImageError> {
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .map_err(|source| ImageError::from_exr(path, source))?;
    let unsupported = |reason: &str| ImageError::Unsupported {
        path: path.to_owned(),
        reason: reason.into(),
    };

    let bounds = file
        .layer_data
        .first()
        .ok_or_else(|| unsupported("no part in the file"))?
        .absolute_bounds();
    let is_multi_part = file.layer_data.len() > 1;
    let mut channels = Vec::new();
    for part in file.layer_data {
        if part.absolute_bounds() != bounds {
            return Err(unsupported("parts with different data windows"));
        }
        let prefix = match &part.attributes.layer_name {
            Some(name) if is_multi_part => format!("{name}."),
            _ => String::new(),
        };
        for channel in part.channel_data.list {
            let name = channel.name.to_string();
            if channel.sampling.area() != 1 {
                return Err(unsupported("subsampled channels"));
            }
            channels.push(Channel {
                name: if name.starts_with(&prefix) {
                    name
                } else {
                    prefix.clone() + &name
                },
                samples: to_f32(channel.sample_data),
            });
        }
    }

    // Count pixels from the corner of the display window, wherever the file has it.
    let display = file.attributes.display_window;
    let min = bounds.position - display.position;
    let max = bounds.end() - display.position;
    Ok(Image {
        resolution: [display.size.width(), display.size.height()].map(|n| n as u32),
        data_window: DataWindow {
            min: [min.x(), min.y()],
            max: [max.x(), max.y()],
        },
        channels,
    })
}

fn to_f32(samples: FlatSamples) -> Vec<f32> {
    match samples {
        FlatSamples::F16(samples) => samples.into_iter().map(half::f16::to_f32).collect(),
        FlatSamples::F32(samples) => samples,
        FlatSamples::U32(samples) => samples.into_iter().map(|v| v as f32).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, ImageAttributes, IntegerBounds, Layer, LayerAttributes,
        SmallVec, Vec2, WritableImage,
    };
    use half::f16;

    use super::*;
    use crate::replace::tests::ScratchDir;

    #[test]
    fn parts_become_layers() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        let part = |name: &str, channel: &str, samples: FlatSamples| {
            Layer::new(
                (2, 1),
                LayerAttributes::named(name),
                Encoding::SMALL_FAST_LOSSLESS,
                AnyChannels::sort(SmallVec::from_vec(vec![AnyChannel::new(channel, samples)])),
            )
        };
        exr::image::Image::empty(ImageAttributes::new(IntegerBounds::from_dimensions((2, 1))))
            .with_layer(part("rgb", "R", FlatSamples::F16(vec![f16::ONE; 2])))
            .with_layer(part("id", "id.X", FlatSamples::U32(vec![7, 8])))
            .write()
            .to_file(&path)
            .unwrap();

        let image = read_exr(&path).unwrap();
        assert_eq!(image.size(), [2, 1]);
        assert_eq!(image.channel("rgb.R"), Some([1.0, 1.0].as_slice()));
        assert_eq!(image.channel("id.X"), Some([7.0, 8.0].as_slice()));
    }

    #[test]
    fn windows_are_relative_to_the_display() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        let samples = FlatSamples::F32(vec![1.0; 6]);
        let layer = Layer::new(
            (3, 2),
            LayerAttributes::default().with_position(Vec2(8, 21)),
            Encoding::SMALL_FAST_LOSSLESS,
            AnyChannels::sort(SmallVec::from_vec(vec![AnyChannel::new("Y", samples)])),
        );
        let display = IntegerBounds::new((10, 20), (5, 4));
        exr::image::Image::new(ImageAttributes::new(display), layer)
            .write()
            .to_file(&path)
            .unwrap();

        let image = read_exr(&path).unwrap();
        assert_eq!(image.resolution, [5, 4]);
        assert_eq!(image.data_window.min, [-2, 1]);
        assert_eq!(image.data_window.max, [1, 3]);
    }

    #[test]
    fn what_is_no_image_is_an_error() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        let missing = read_exr(&path).unwrap_err();
        assert!(matches!(missing, ImageError::Io { .. }), "{missing}");
        assert!(missing.to_string().contains("a.exr"), "{missing}");
        fs::write(&path, "no image at all, but long enough for a header").unwrap();
        let invalid = read_exr(&path).unwrap_err();
        assert!(matches!(invalid, ImageError::Exr { .. }), "{invalid}");
    }
}
