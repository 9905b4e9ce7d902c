//! What the samples of a tile have left, as bytes: to go on from it elsewhere, or later.

use super::Tile;
use crate::aov::Rule;

/// Bytes that are not the sums of a tile of this size with these layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the sums of the tile take {expected} bytes, not {found}")]
pub struct SumsError {
    /// How many the tile has.
    pub expected: usize,
    /// How many there are.
    pub found: usize,
}

const COUNT_BYTES: usize = size_of::<u64>();

impl Tile {
    /// All that the samples so far have left: samples that go on from it give the same bits as if
    /// nothing had happened in between.
    ///
    /// Arrays of little-endian numbers one after the other: the count of invalid samples (u64); red,
    /// green, blue and opacity of all pixels (f64); their numbers of samples (u32); spread of the
    /// luminance (f64), layers (f32) and distance of the nearest sample (f32), as far as the film
    /// has them.
    pub fn sums(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.n_sums_bytes());
        bytes.extend(self.n_invalid.to_le_bytes());
        for sum in &self.beauty {
            for value in [sum.rgb[0], sum.rgb[1], sum.rgb[2], sum.alpha] {
                bytes.extend(value.to_le_bytes());
            }
        }
        for sum in &self.beauty {
            bytes.extend(sum.n_samples.to_le_bytes());
        }
        for value in &self.luminance_m2 {
            bytes.extend(value.to_le_bytes());
        }
        for value in self.values.iter().chain(&self.nearest_sq) {
            bytes.extend(value.to_le_bytes());
        }
        bytes
    }

    /// Goes on from what [`Self::sums`] gave for the same tile of a film with the same layers.
    pub fn set_sums(&mut self, bytes: &[u8]) -> Result<(), SumsError> {
        let expected = self.n_sums_bytes();
        if bytes.len() != expected {
            return Err(SumsError {
                expected,
                found: bytes.len(),
            });
        }
        let mut numbers = Numbers(bytes);
        self.n_invalid = u64::from_le_bytes(numbers.next());
        for sum in &mut self.beauty {
            for value in sum.rgb.iter_mut().chain([&mut sum.alpha]) {
                *value = f64::from_le_bytes(numbers.next());
            }
        }
        for sum in &mut self.beauty {
            sum.n_samples = u32::from_le_bytes(numbers.next());
        }
        for value in &mut self.luminance_m2 {
            *value = f64::from_le_bytes(numbers.next());
        }
        for value in self.values.iter_mut().chain(&mut self.nearest_sq) {
            *value = f32::from_le_bytes(numbers.next());
        }
        Ok(())
    }

    /// Forgets all samples.
    pub fn clear(&mut self) {
        self.n_invalid = 0;
        self.beauty.fill_with(Default::default);
        self.luminance_m2.fill(0.0);
        self.nearest_sq.fill(f32::INFINITY);
        let stride = self.values.len() / self.beauty.len();
        for pixel in self.values.chunks_exact_mut(stride.max(1)) {
            for layer in &self.layers {
                pixel[layer.channels.clone()].fill(layer.rule.empty());
            }
        }
    }

    /// How many bytes [`Self::sums`] gives.
    fn n_sums_bytes(&self) -> usize {
        let per_pixel = 4 * size_of::<f64>() + size_of::<u32>();
        COUNT_BYTES
            + per_pixel * self.beauty.len()
            + size_of_val(self.luminance_m2.as_slice())
            + size_of_val(self.values.as_slice())
            + size_of_val(self.nearest_sq.as_slice())
    }
}

impl Rule {
    /// What a layer shows without samples.
    pub(super) fn empty(self) -> f32 {
        match self {
            Self::Mean { .. } | Self::Statistic => 0.0,
            Self::Nearest { empty, .. } => empty,
        }
    }
}

/// Takes numbers from the front of bytes whose length has been checked.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn next<const N: usize>(&mut self) -> [u8; N] {
        let (number, rest) = self.0.split_first_chunk().expect("the length was checked");
        self.0 = rest;
        *number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aov, PixelSample};
    use kilauea_math::hash::{mix32, unit_f32};
    use kilauea_math::{Spectrum, Vec3};
    use kilauea_scene::DataWindow;

    fn tile(aovs: &[Aov]) -> Tile {
        let bounds = DataWindow {
            min: [-1, 2],
            max: [4, 5],
        };
        Tile::new(bounds, aovs, aovs.contains(&Aov::Variance))
    }

    /// Adds samples with those numbers to each pixel.
    fn sample(tile: &mut Tile, numbers: std::ops::Range<u32>) {
        for pixel in 0..tile.n_pixels() {
            for number in numbers.clone() {
                let random = |i: u32| unit_f32(mix32(mix32(number) ^ mix32(pixel as u32 * 8 + i)));
                let broken = if random(0) < 0.1 { f32::NAN } else { 1.0 };
                tile.add(
                    pixel,
                    &PixelSample {
                        beauty: Spectrum::new(random(1), random(2), broken),
                        n: Vec3::new(random(3), random(4), 0.3),
                        z: random(5),
                        offset_sq: random(6),
                        prim_id: number as i32,
                        ..PixelSample::default()
                    },
                );
            }
        }
    }

    #[test]
    fn samples_go_on_elsewhere_with_the_same_bits() {
        let all: Vec<Aov> = Aov::all().collect();
        for aovs in [
            &all[..],
            &[Aov::Beauty],
            &[Aov::Beauty, Aov::N],
            &[Aov::Beauty, Aov::Z],
        ] {
            let mut whole = tile(aovs);
            sample(&mut whole, 0..9);
            let mut first = tile(aovs);
            sample(&mut first, 0..4);
            let mut second = tile(aovs);
            second.set_sums(&first.sums()).unwrap();
            assert_eq!(second.sums(), first.sums());
            sample(&mut second, 4..9);
            assert_eq!(second.sums(), whole.sums());
            assert!(whole.n_invalid() > 0);
        }
    }

    #[test]
    fn a_cleared_tile_is_a_new_one() {
        let all: Vec<Aov> = Aov::all().collect();
        for aovs in [&all[..], &[Aov::Beauty]] {
            let mut used = tile(aovs);
            sample(&mut used, 0..3);
            used.clear();
            assert_eq!(used.sums(), tile(aovs).sums());
        }
    }

    #[test]
    fn other_lengths_are_refused() {
        let mut tile = tile(&[Aov::Beauty]);
        let mut bytes = tile.sums();
        bytes.push(0);
        let error = tile.set_sums(&bytes).unwrap_err();
        assert_eq!(error.found, error.expected + 1);
        assert!(tile.set_sums(&[]).is_err());
    }
}
