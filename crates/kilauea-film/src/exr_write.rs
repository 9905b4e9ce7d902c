use std::path::Path;

use exr::image::Blocks;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, Encoding, FlatSamples, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, LineOrder, SmallVec, Text, Vec2, WritableImage,
    attribute,
};
use half::f16;

use crate::metadata::{ExrCamera, cap_date, fraction};
use crate::replace::write_replacing;
use crate::{Film, Image, ImageError, ImageMetadata, Packing};

/// What wrote the file.
const SOFTWARE: &str = concat!("Kilauea ", env!("CARGO_PKG_VERSION"));

/// Writes every layer of a film into one single-part EXR file: channels `R`, `G`, `B`, `A` for
/// the beauty and `layer.channel` for the others, packed as asked, linear Rec. 709.
///
/// The file appears whole or not at all. Nothing is left behind on an error.
pub fn write_exr(path: &Path, film: &Film, metadata: &ImageMetadata) -> Result<(), ImageError> {
    let image = film.to_image(metadata.origin_world);
    let half = film.aovs().iter().flat_map(|aov| {
        let as_half = metadata.half_radiance && aov.row().half_allowed;
        aov.channels().iter().map(move |_| as_half)
    });
    write_image(path, image, half.collect(), metadata)
}

/// Writes an image of any channels as [`write_exr`] does those of a film, all of them in 32 bits.
pub fn write_image_exr(
    path: &Path,
    image: Image,
    metadata: &ImageMetadata,
) -> Result<(), ImageError> {
    let half = vec![false; image.channels.len()];
    write_image(path, image, half, metadata)
}

/// `half` is whether a channel is written in 16 bits.
fn write_image(
    path: &Path,
    image: Image,
    half: Vec<bool>,
    metadata: &ImageMetadata,
) -> Result<(), ImageError> {
    let [width, height] = image.size();
    if width == 0 || height == 0 {
        return Err(ImageError::Empty);
    }

    let attributes = image_attributes(&image, metadata);
    let layer = Layer::new(
        (width, height),
        layer_attributes(&image, metadata),
        Encoding {
            compression: match metadata.packing {
                Packing::Small => Compression::ZIP1,
                Packing::Fast => Compression::RLE,
            },
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        },
        channels(image, half),
    );
    let file_image = exr::image::Image {
        attributes,
        layer_data: layer,
    };
    write_replacing(path, |writer| {
        file_image
            .write()
            .to_buffered(writer)
            .map_err(|source| ImageError::from_exr(path, source))
    })
}

/// The channels of an image, sorted by name as the format wants them.
fn channels(image: Image, half: Vec<bool>) -> AnyChannels<FlatSamples> {
    let channels: SmallVec<[_; 4]> = image
        .channels
        .into_iter()
        .zip(half)
        .map(|(channel, as_half)| {
            let samples = if as_half {
                FlatSamples::F16(channel.samples.iter().map(|&v| to_half(v)).collect())
            } else {
                FlatSamples::F32(channel.samples)
            };
            AnyChannel::new(text(&channel.name), samples)
        })
        .collect();
    AnyChannels::sort(channels)
}

/// The nearest half; what is too large becomes the largest, not infinity.
fn to_half(value: f32) -> f16 {
    f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))
}

/// Attributes that every part of a file would share.
fn image_attributes(image: &Image, metadata: &ImageMetadata) -> ImageAttributes {
    let [width, height] = image.resolution;
    ImageAttributes {
        pixel_aspect: metadata.pixel_aspect_ratio,
        chromaticities: Some(attribute::Chromaticities {
            red: Vec2(0.64, 0.33),
            green: Vec2(0.3, 0.6),
            blue: Vec2(0.15, 0.06),
            white: Vec2(0.3127, 0.329),
        }),
        ..ImageAttributes::new(IntegerBounds::from_dimensions((
            width as usize,
            height as usize,
        )))
    }
}

/// Attributes of the part.
fn layer_attributes(image: &Image, metadata: &ImageMetadata) -> LayerAttributes {
    let [x, y] = image.data_window.min;
    let mut attributes = LayerAttributes {
        layer_position: Vec2(x, y),
        software_name: Some(text(SOFTWARE)),
        frames_per_second: metadata.frames_per_second.and_then(fraction),
        ..LayerAttributes::default()
    };
    if let Some(time) = metadata.capture_time {
        attributes.capture_date = Some(text(&cap_date(time)));
        attributes.utc_offset = Some(0.0);
    }
    if let Some(camera) = &metadata.camera {
        let exr_camera = ExrCamera::new(camera);
        let [center_x, center_y] = exr_camera.screen_window_center;
        attributes.world_to_camera = Some(exr_camera.world_to_camera);
        attributes.world_to_normalized_device = Some(exr_camera.world_to_ndc);
        attributes.screen_window_center = Vec2(center_x, center_y);
        attributes.screen_window_width = exr_camera.screen_window_width;
        let [near, far] = camera.clipping_range;
        attributes.near_clip_plane = Some(near as f32);
        attributes.far_clip_plane = Some(far as f32);
    }
    if let Some(time) = metadata.render_time {
        attributes
            .other
            .insert(text("renderTime"), AttributeValue::F32(time.as_secs_f32()));
    }
    for (name, value) in &metadata.attributes {
        attributes
            .other
            .insert(text(name), AttributeValue::Text(text(value)));
    }
    attributes
}

/// Texts are UTF-8 in OpenEXR files.
fn text(s: &str) -> Text {
    Text::from_bytes_unchecked(SmallVec::from_slice(s.as_bytes()))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;
    use std::time::{Duration, SystemTime};

    use exr::prelude::read_first_flat_layer_from_file;
    use kilauea_math::hash::{mix32, unit_f32};
    use kilauea_math::{DVec3, Spectrum, Vec3};
    use kilauea_scene::{DataWindow, Projection};

    use super::*;
    use crate::replace::tests::ScratchDir;
    use crate::{Aov, FilmSettings, PixelSample, read_exr};

    /// A film with overscan on one side and a crop on the other, full of noise.
    fn noisy_film(aovs: Vec<Aov>) -> Film {
        let film = Film::new(FilmSettings {
            resolution: [70, 40],
            data_window: DataWindow {
                min: [-3, 5],
                max: [50, 38],
            },
            tile_size: 16,
            aovs,
            tracks_variance: false,
        });
        for tile_idx in 0..film.n_tiles() {
            let mut tile = film.tile(tile_idx);
            for pixel_idx in 0..tile.n_pixels() {
                for i in 0..2 {
                    let seed = ((tile_idx << 12) + (pixel_idx << 1) + i) as u32;
                    let random = |d: u32| unit_f32(mix32(seed * 16 + d));
                    let rgb = |d| Spectrum::new(random(d), random(d + 1), random(d + 2));
                    tile.add(
                        pixel_idx,
                        &PixelSample {
                            beauty: 1e5 * rgb(0),
                            alpha: random(3),
                            albedo: rgb(4),
                            p: Vec3::splat(random(7)),
                            z: 1.0 + random(7),
                            prim_id: (100_000.0 * random(8)) as i32,
                            offset_sq: random(9),
                            ..PixelSample::default()
                        },
                    );
                }
            }
        }
        film
    }

    fn metadata() -> ImageMetadata {
        ImageMetadata {
            origin_world: DVec3::splat(1000.0),
            pixel_aspect_ratio: 2.0,
            camera: Some(crate::metadata::tests::camera(Projection::Perspective)),
            frames_per_second: Some(23.976),
            capture_time: Some(SystemTime::UNIX_EPOCH),
            render_time: Some(Duration::from_millis(1500)),
            packing: Packing::Small,
            half_radiance: false,
            attributes: BTreeMap::from([
                ("kilauea/stats".into(), r#"{"n":1}"#.into()),
                ("kilauea/warnings".into(), "/世界: über".into()),
            ]),
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        let film = noisy_film(Aov::all().collect());
        write_exr(&path, &film, &metadata()).unwrap();

        let mut expected = film.to_image(metadata().origin_world);
        expected.channels.sort_by(|a, b| a.name.cmp(&b.name));
        assert_eq!(read_exr(&path).unwrap(), expected);
        assert_eq!(dir.names(), ["a.exr"]);
    }

    #[test]
    fn the_header_describes_the_frame() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        write_exr(&path, &noisy_film(vec![Aov::Z]), &metadata()).unwrap();

        let file = read_first_flat_layer_from_file(&path).unwrap();
        let (shared, own) = (&file.attributes, &file.layer_data.attributes);
        assert_eq!(shared.display_window.position, Vec2(0, 0));
        assert_eq!(shared.display_window.size, Vec2(70, 40));
        assert_eq!(shared.pixel_aspect, 2.0);
        assert_eq!(shared.chromaticities.unwrap().red, Vec2(0.64, 0.33));
        assert_eq!(own.layer_position, Vec2(-3, 5));
        assert_eq!(file.layer_data.size, Vec2(53, 33));
        assert_eq!(file.layer_data.encoding.compression, Compression::ZIP1);
        assert_eq!(own.frames_per_second, Some((24_000, 1001)));
        assert_eq!(own.capture_date, Some(text("1970:01:01 00:00:00")));
        assert_eq!(own.software_name, Some(text(SOFTWARE)));
        assert_eq!(own.screen_window_width, 2.0);
        assert_eq!(own.screen_window_center, Vec2(0.5, 0.25));
        let exr_camera = ExrCamera::new(&metadata().camera.unwrap());
        assert_eq!(own.world_to_camera, Some(exr_camera.world_to_camera));
        assert_eq!(
            own.world_to_normalized_device,
            Some(exr_camera.world_to_ndc)
        );
        assert_eq!(own.other[&text("renderTime")], AttributeValue::F32(1.5));
        for (name, value) in metadata().attributes {
            let expected = AttributeValue::Text(text(&value));
            assert_eq!(own.other[&text(&name)], expected, "{name}");
        }
    }

    #[test]
    fn half_is_for_radiance_alone_and_never_infinite() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        let film = noisy_film(vec![Aov::Z, Aov::Albedo, Aov::PrimId]);
        let metadata = ImageMetadata {
            half_radiance: true,
            ..ImageMetadata::default()
        };
        write_exr(&path, &film, &metadata).unwrap();

        let file = read_first_flat_layer_from_file(&path).unwrap();
        let mut largest: f32 = 0.0;
        for channel in &file.layer_data.channel_data.list {
            let is_half = matches!(channel.sample_data, FlatSamples::F16(_));
            let name = channel.name.to_string();
            assert_eq!(is_half, !["Z", "primId"].contains(&name.as_str()), "{name}");
            if is_half {
                largest = channel.sample_data.values_as_f32().fold(largest, f32::max);
            }
        }
        assert_eq!(largest, 65504.0);
    }

    #[test]
    fn no_error_leaves_a_file() {
        let dir = ScratchDir::new();
        let film = noisy_film(vec![]);
        let missing = dir.0.join("missing").join("a.exr");
        assert!(write_exr(&missing, &film, &metadata()).is_err());

        let directory = dir.0.join("d.exr");
        fs::create_dir(&directory).unwrap();
        assert!(write_exr(&directory, &film, &metadata()).is_err());

        let mut reserved = metadata();
        reserved.attributes.insert("dataWindow".into(), "x".into());
        let error = write_exr(&dir.0.join("a.exr"), &film, &reserved).unwrap_err();
        assert!(matches!(error, ImageError::Exr { .. }), "{error}");

        let empty = Film::new(FilmSettings {
            resolution: [4, 4],
            data_window: DataWindow {
                min: [2, 2],
                max: [2, 4],
            },
            tile_size: 16,
            aovs: vec![],
            tracks_variance: false,
        });
        let error = write_exr(&dir.0.join("a.exr"), &empty, &metadata()).unwrap_err();
        assert!(matches!(error, ImageError::Empty), "{error}");
        assert_eq!(dir.names(), ["d.exr"]);
    }
}
