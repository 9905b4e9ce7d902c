use kilauea_scene::DataWindow;

use crate::ImageError;
use crate::tile::size;

/// A picture in memory: named channels over one data window.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Display window in pixels: width, height.
    pub resolution: [u32; 2],
    /// Pixels that there are values for.
    pub data_window: DataWindow,
    /// The channels, each with a value for every pixel of the data window.
    pub channels: Vec<Channel>,
}

/// One channel of an [`Image`].
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// `R`, `Z`, `layer.R` or the like.
    pub name: String,
    /// Row after row from the upper left.
    pub samples: Vec<f32>,
}

/// Names that renderers give to the layer of the picture itself.
const BEAUTY_LAYERS: [&str; 7] = ["beauty", "Combined", "C", "Ci", "rgba", "rgb", "color"];

impl Image {
    /// A picture with values for all of its pixels.
    pub fn whole(resolution: [u32; 2], channels: Vec<Channel>) -> Self {
        Self {
            resolution,
            data_window: DataWindow {
                min: [0, 0],
                max: resolution.map(|n| n as i32),
            },
            channels,
        }
    }

    /// Width and height of the data window in pixels.
    pub fn size(&self) -> [usize; 2] {
        size(self.data_window)
    }

    /// Values of a channel.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels
            .iter()
            .find(|channel| channel.name == name)
            .map(|channel| channel.samples.as_slice())
    }

    /// The picture itself: `R`, `G` and `B`, or else those of the layer that has a name usual for
    /// it (`ViewLayer.Combined.R` of Cycles), or else those of the only layer that has all three.
    pub fn rgb(&self) -> Result<[&[f32]; 3], ImageError> {
        let rgb_of = |prefix: &str| -> Option<[&[f32]; 3]> {
            let channel = |c: &str| self.channel(&format!("{prefix}{c}"));
            Some([channel("R")?, channel("G")?, channel("B")?])
        };
        let layers: Vec<&str> = self
            .channels
            .iter()
            .filter_map(|channel| channel.name.strip_suffix('R'))
            .filter(|prefix| prefix.is_empty() || prefix.ends_with('.'))
            .filter(|prefix| rgb_of(prefix).is_some())
            .collect();
        let is_usual = |prefix: &&&str| {
            let layer = prefix.trim_end_matches('.');
            let last = layer.rsplit('.').next().unwrap_or(layer);
            BEAUTY_LAYERS
                .iter()
                .any(|name| name.eq_ignore_ascii_case(last))
        };
        layers
            .iter()
            .find(|prefix| prefix.is_empty())
            .or_else(|| layers.iter().find(is_usual))
            .or(match layers.as_slice() {
                [only] => Some(only),
                _ => None,
            })
            .and_then(|prefix| rgb_of(prefix))
            .ok_or_else(|| ImageError::NoBeauty {
                channels: self
                    .channels
                    .iter()
                    .map(|channel| channel.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", "),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(names: &[&str], expected: Option<f32>) {
        let image = Image {
            resolution: [1, 1],
            data_window: DataWindow {
                min: [0, 0],
                max: [1, 1],
            },
            channels: names
                .iter()
                .enumerate()
                .map(|(i, &name)| Channel {
                    name: name.to_owned(),
                    samples: vec![i as f32],
                })
                .collect(),
        };
        let red = image.rgb().ok().map(|[r, _, _]| r[0]);
        assert_eq!(red, expected, "{names:?}");
    }

    #[test]
    fn the_picture_is_found() {
        check(&["A", "B", "G", "R"], Some(3.0));
        check(
            &["albedo.R", "albedo.G", "albedo.B", "R", "G", "B"],
            Some(3.0),
        );
        check(
            &[
                "ViewLayer.DiffDir.R",
                "ViewLayer.DiffDir.G",
                "ViewLayer.DiffDir.B",
                "ViewLayer.Combined.R",
                "ViewLayer.Combined.G",
                "ViewLayer.Combined.B",
            ],
            Some(3.0),
        );
        check(&["left.R", "left.G", "left.B"], Some(0.0));
        check(&["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"], None);
        check(&["Y"], None);
        check(&["R", "G"], None);
    }
}
