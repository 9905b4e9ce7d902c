use std::sync::{Mutex, MutexGuard, PoisonError};

use kilauea_math::DVec3;
use kilauea_scene::DataWindow;

use crate::tile::size;
use crate::{Aov, Channel, Image, Tile};

/// What a [`Film`] records.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSettings {
    /// Display window in pixels: width, height.
    pub resolution: [u32; 2],
    /// Pixels that are recorded.
    pub data_window: DataWindow,
    /// Edge length of the tiles in pixels.
    pub tile_size: u32,
    /// Layers to record besides the beauty; only these take memory.
    pub aovs: Vec<Aov>,
    /// Whether pixels know their variance even where no layer shows it.
    pub tracks_variance: bool,
}

/// The samples of one frame, in tiles that threads fill at the same time.
#[derive(Debug)]
pub struct Film {
    resolution: [u32; 2],
    data_window: DataWindow,
    aovs: Vec<Aov>,
    tiles: Vec<Mutex<Tile>>,
}

impl Film {
    /// An empty film. Its tiles are numbered from the center of the picture outwards.
    pub fn new(settings: FilmSettings) -> Self {
        let mut aovs = settings.aovs;
        let tracks_variance = settings.tracks_variance || aovs.contains(&Aov::Variance);
        aovs.push(Aov::Beauty);
        aovs.sort_unstable();
        aovs.dedup();
        let tiles = tile_bounds(settings.data_window, settings.tile_size)
            .into_iter()
            .map(|bounds| Mutex::new(Tile::new(bounds, &aovs, tracks_variance)))
            .collect();
        Self {
            resolution: settings.resolution,
            data_window: settings.data_window,
            aovs,
            tiles,
        }
    }

    /// The pixels that it has.
    pub fn data_window(&self) -> DataWindow {
        self.data_window
    }

    /// Layers that are recorded, the beauty first.
    pub fn aovs(&self) -> &[Aov] {
        &self.aovs
    }

    /// How many pixels there are.
    pub fn n_pixels(&self) -> u64 {
        size(self.data_window).map(|n| n as u64).iter().product()
    }

    /// How many tiles there are.
    pub fn n_tiles(&self) -> usize {
        self.tiles.len()
    }

    /// A tile, for the caller alone until the guard is dropped; waits while another thread has it.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn tile(&self, tile_idx: usize) -> MutexGuard<'_, Tile> {
        // A sample is added whole or not at all, so a panic elsewhere leaves nothing half done
        // that matters for writing what there is.
        self.tiles[tile_idx]
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Samples in all pixels.
    pub fn n_samples(&self) -> u64 {
        self.sum(|tile| {
            (0..tile.n_pixels())
                .map(|idx| u64::from(tile.n_samples(idx)))
                .sum()
        })
    }

    /// Samples whose light was NaN or infinite and was taken as black.
    pub fn n_invalid(&self) -> u64 {
        self.sum(Tile::n_invalid)
    }

    /// Bytes that the pixels take.
    pub fn n_bytes(&self) -> u64 {
        self.sum(|tile| tile.n_bytes() as u64)
    }

    /// The picture so far, with every layer. `origin_world` is the world-space point that
    /// engine-space positions are relative to.
    pub fn to_image(&self, origin_world: DVec3) -> Image {
        let [width, height] = size(self.data_window);
        let mut channels: Vec<Channel> = self
            .aovs
            .iter()
            .flat_map(|aov| aov.channels())
            .map(|&name| Channel {
                name: name.to_owned(),
                samples: vec![0.0; width * height],
            })
            .collect();

        for tile_idx in 0..self.n_tiles() {
            let tile = self.tile(tile_idx);
            for (pixel_idx, [x, y]) in tile.pixels().enumerate() {
                let column = (i64::from(x) - i64::from(self.data_window.min[0])) as usize;
                let row = (i64::from(y) - i64::from(self.data_window.min[1])) as usize;
                let mut planes = channels.iter_mut();
                for &aov in &self.aovs {
                    let mut pixel = [0.0; 4];
                    let pixel = &mut pixel[..aov.channels().len()];
                    tile.resolve(aov, pixel_idx, pixel);
                    if aov == Aov::P {
                        to_world(pixel, origin_world);
                    }
                    for (&value, plane) in pixel.iter().zip(&mut planes) {
                        plane.samples[row * width + column] = value;
                    }
                }
            }
        }
        Image {
            resolution: self.resolution,
            data_window: self.data_window,
            channels,
        }
    }

    fn sum(&self, of: impl Fn(&Tile) -> u64) -> u64 {
        (0..self.n_tiles()).map(|idx| of(&self.tile(idx))).sum()
    }
}

/// Moves a position from engine to world space; infinity, which marks a miss, becomes zero.
fn to_world(p: &mut [f32], origin_world: DVec3) {
    for (value, origin) in p.iter_mut().zip(origin_world.to_array()) {
        *value = if value.is_finite() {
            (f64::from(*value) + origin) as f32
        } else {
            0.0
        };
    }
}

/// Cuts a window into tiles, nearest to its center first.
fn tile_bounds(window: DataWindow, tile_size: u32) -> Vec<DataWindow> {
    let step = tile_size.max(1) as usize;
    let [width, height] = size(window);
    let corner = |axis: usize, offset: usize| {
        let position = i64::from(window.min[axis]) + offset as i64;
        position.min(i64::from(window.max[axis])) as i32
    };
    let mut tiles: Vec<DataWindow> = (0..height)
        .step_by(step)
        .flat_map(|y| (0..width).step_by(step).map(move |x| [x, y]))
        .map(|[x, y]| DataWindow {
            min: [corner(0, x), corner(1, y)],
            max: [corner(0, x + step), corner(1, y + step)],
        })
        .collect();

    // Twice the distance between two centers per axis is a whole number.
    let center =
        |w: &DataWindow| [0, 1].map(|axis| i64::from(w.min[axis]) + i64::from(w.max[axis]));
    let [center_x, center_y] = center(&window);
    tiles.sort_by_key(|tile| {
        let [x, y] = center(tile);
        i128::from(x - center_x).pow(2) + i128::from(y - center_y).pow(2)
    });
    tiles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PixelSample;
    use kilauea_math::hash::{mix32, unit_f32};
    use kilauea_math::{Spectrum, Vec3};

    fn film(min: [i32; 2], max: [i32; 2], aovs: &[Aov]) -> Film {
        Film::new(FilmSettings {
            resolution: [64, 48],
            data_window: DataWindow { min, max },
            tile_size: 16,
            aovs: aovs.to_vec(),
            tracks_variance: false,
        })
    }

    fn one_pixel(aovs: &[Aov], samples: &[PixelSample]) -> (Film, Image) {
        let film = film([0, 0], [1, 1], aovs);
        for sample in samples {
            film.tile(0).add(0, sample);
        }
        let image = film.to_image(DVec3::new(100.0, 0.0, 0.0));
        (film, image)
    }

    fn value(image: &Image, channel: &str) -> f32 {
        image.channel(channel).unwrap()[0]
    }

    fn gray(value: f32) -> PixelSample {
        PixelSample {
            beauty: Spectrum::splat(value),
            alpha: 1.0,
            ..PixelSample::default()
        }
    }

    #[test]
    fn tiles_cover_every_pixel_once_from_the_center() {
        for (min, max) in [
            ([0, 0], [64, 48]),
            ([-5, -7], [70, 3]),
            ([3, 4], [4, 5]),
            ([3, 4], [3, 9]),
            ([9, 9], [0, 0]),
        ] {
            let film = film(min, max, &[]);
            let mut pixels: Vec<[i32; 2]> = (0..film.n_tiles())
                .flat_map(|idx| film.tile(idx).pixels())
                .collect();
            if let Some(&first) = pixels.first() {
                let mid = i32::midpoint(min[0], max[0]);
                assert!((first[0] - mid).abs() <= 16, "{first:?}");
            }
            pixels.sort_unstable_by_key(|&[x, y]| [y, x]);
            let expected: Vec<[i32; 2]> = (min[1]..max[1])
                .flat_map(|y| (min[0]..max[0]).map(move |x| [x, y]))
                .collect();
            assert_eq!(pixels, expected);
        }
    }

    #[test]
    fn pixels_land_where_they_belong() {
        let film = film([-3, 2], [37, 29], &[]);
        for tile_idx in 0..film.n_tiles() {
            let mut tile = film.tile(tile_idx);
            for (idx, [x, y]) in tile.pixels().enumerate() {
                let beauty = Spectrum::new(x as f32, y as f32, 0.0);
                tile.add(
                    idx,
                    &PixelSample {
                        beauty,
                        ..PixelSample::default()
                    },
                );
            }
        }
        let image = film.to_image(DVec3::ZERO);
        for (i, (&r, &g)) in image
            .channel("R")
            .unwrap()
            .iter()
            .zip(image.channel("G").unwrap())
            .enumerate()
        {
            assert_eq!([r, g], [(i % 40) as f32 - 3.0, (i / 40) as f32 + 2.0]);
        }
        assert_eq!(film.n_samples(), 40 * 27);
    }

    #[test]
    fn mean_and_variance_survive_many_samples_far_from_zero() {
        let samples: Vec<PixelSample> = (0..100_000)
            .map(|i| gray(1000.0 + unit_f32(mix32(i))))
            .collect();
        let (_, image) = one_pixel(&[Aov::Variance, Aov::SampleCount], &samples);
        assert!((value(&image, "R") - 1000.5).abs() < 5e-3);
        let expected = 1.0 / 12.0 / 1e5;
        let variance = value(&image, "variance");
        assert!((variance / expected - 1.0).abs() < 0.02, "{variance}");
        assert_eq!(value(&image, "sample_count"), 1e5);
    }

    #[test]
    fn averages_of_a_constant_are_exact() {
        let albedo = Spectrum::new(0.1, 0.2, 0.7);
        let samples = vec![
            PixelSample {
                albedo,
                ..gray(0.1)
            };
            70_000
        ];
        let (_, image) = one_pixel(&[Aov::Albedo], &samples);
        assert_eq!(value(&image, "albedo.B"), 0.7);
        assert_eq!(value(&image, "R"), 0.1);
    }

    #[test]
    fn one_sample_says_nothing_about_variance() {
        let (film, image) = one_pixel(&[Aov::Variance], &[gray(1.0)]);
        assert_eq!(value(&image, "variance"), f32::INFINITY);
        film.tile(0).add(0, &gray(3.0));
        assert_eq!(film.tile(0).variance(0), Some(1.0));
    }

    #[test]
    fn invalid_light_is_black_and_counted() {
        for bad in [f32::NAN, f32::INFINITY] {
            let broken = PixelSample {
                direct_diffuse: Spectrum::splat(7.0),
                albedo: Spectrum::splat(0.5),
                ..gray(bad)
            };
            let (film, image) = one_pixel(
                &[Aov::DirectDiffuse, Aov::Albedo, Aov::Variance],
                &[gray(4.0), broken],
            );
            assert_eq!(film.n_invalid(), 1);
            assert_eq!(film.n_samples(), 2);
            assert_eq!(value(&image, "R"), 2.0);
            assert_eq!(value(&image, "A"), 1.0);
            assert_eq!(value(&image, "direct_diffuse.R"), 0.0);
            assert_eq!(value(&image, "albedo.R"), 0.25);
            assert_eq!(value(&image, "variance"), 4.0);
        }
    }

    #[test]
    fn one_broken_layer_does_not_hurt_the_others() {
        let broken = PixelSample {
            emission: Spectrum::splat(f32::NAN),
            n: Vec3::splat(f32::NAN),
            z: f32::NAN,
            ..gray(4.0)
        };
        let (film, image) = one_pixel(&[Aov::Emission, Aov::N, Aov::Z], &[broken]);
        assert_eq!(film.n_invalid(), 1);
        assert_eq!(value(&image, "R"), 4.0);
        assert_eq!(value(&image, "emission.R"), 0.0);
        assert_eq!(value(&image, "N.X"), 0.0);
        assert_eq!(value(&image, "Z"), f32::INFINITY);
    }

    #[test]
    fn ids_and_positions_come_from_the_central_sample() {
        let at = |offset_sq, prim_id, p: f32, z| PixelSample {
            offset_sq,
            prim_id,
            instance_id: 10 * prim_id,
            p: Vec3::splat(p),
            z,
            n: Vec3::splat(p),
            ..gray(0.0)
        };
        let aovs = [Aov::PrimId, Aov::InstanceId, Aov::P, Aov::Z, Aov::N];
        let (_, image) = one_pixel(
            &aovs,
            &[
                at(0.3, 1, 1.0, 11.0),
                at(0.1, 2, 2.0, 12.0),
                at(0.1, 3, 3.0, 13.0),
            ],
        );
        assert_eq!(value(&image, "primId"), 2.0);
        assert_eq!(value(&image, "instanceId"), 20.0);
        assert_eq!(value(&image, "P.X"), 102.0);
        assert_eq!(value(&image, "P.Y"), 2.0);
        assert_eq!(value(&image, "Z"), 12.0);
        assert_eq!(value(&image, "N.X"), 2.0);

        let (_, image) = one_pixel(&aovs, &[PixelSample::default()]);
        assert_eq!(value(&image, "primId"), -1.0);
        assert_eq!(value(&image, "P.X"), 0.0);
        assert_eq!(value(&image, "Z"), f32::INFINITY);
    }

    #[test]
    fn only_requested_layers_take_memory() {
        let bytes = |aovs: &[Aov]| film([0, 0], [10, 10], aovs).n_bytes() / 100;
        let beauty = bytes(&[]);
        assert_eq!(bytes(&[Aov::Beauty, Aov::SampleCount]), beauty);
        assert_eq!(bytes(&[Aov::Albedo]), beauty + 12);
        assert_eq!(bytes(&[Aov::Variance]), beauty + 8);
        assert_eq!(bytes(&[Aov::Z, Aov::PrimId]), beauty + 12);
    }
}
