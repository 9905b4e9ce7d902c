use std::path::Path;

use crate::replace::write_replacing;
use crate::{Image, ImageError};

/// Writes the picture as 8-bit sRGB: each channel clamped to [0, 1], no tone mapping, no
/// dithering, over black where it is transparent. For looking at, not for comparing.
///
/// The file appears whole or not at all. Nothing is left behind on an error.
pub fn write_png(path: &Path, image: &Image) -> Result<(), ImageError> {
    let [width, height] = image.size();
    if width == 0 || height == 0 {
        return Err(ImageError::Empty);
    }
    let [r, g, b] = image.rgb()?;
    let bytes: Vec<u8> = r
        .iter()
        .zip(g)
        .zip(b)
        .flat_map(|((&r, &g), &b)| [r, g, b].map(srgb_byte))
        .collect();

    let png_error = |source| match source {
        png::EncodingError::IoError(source) => ImageError::Io {
            path: path.to_owned(),
            source,
        },
        source => ImageError::Png {
            path: path.to_owned(),
            source,
        },
    };
    write_replacing(path, |writer| {
        let mut encoder = png::Encoder::new(writer, width as u32, height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(png_error)?;
        writer.write_image_data(&bytes).map_err(png_error)?;
        writer.finish().map_err(png_error)
    })
}

/// The sRGB transfer curve (IEC 61966-2-1), rounded to 8 bits; NaN is black.
fn srgb_byte(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.0031308 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    // A float cast saturates and takes NaN to zero.
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::BufReader;

    use kilauea_scene::DataWindow;

    use super::*;
    use crate::Channel;
    use crate::replace::tests::ScratchDir;

    #[test]
    fn pixels_are_srgb_bytes() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.png");
        let channel = |name: &str, samples: [f32; 3]| Channel {
            name: name.into(),
            samples: samples.to_vec(),
        };
        let image = Image {
            resolution: [3, 1],
            data_window: DataWindow {
                min: [0, 0],
                max: [3, 1],
            },
            channels: vec![
                channel("R", [0.0, 1.0, f32::NAN]),
                channel("G", [0.18, 7.0, -1.0]),
                channel("B", [0.002, 0.5, f32::INFINITY]),
            ],
        };
        write_png(&path, &image).unwrap();

        let decoder = png::Decoder::new(BufReader::new(File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = [0; 9];
        reader.next_frame(&mut bytes).unwrap();
        // 0.18 is 118 in sRGB, 0.5 is 188, 0.002 is on the linear part.
        assert_eq!(bytes, [0, 118, 7, 255, 255, 188, 0, 0, 255]);
        assert_eq!(dir.names(), ["a.png"]);
    }
}
