//! Owen-scrambled Sobol points, padded two dimensions at a time, indexed for blue noise.
//!
//! One global sequence serves the whole image: a pixel owns a run of consecutive indices, and runs
//! are ordered along a Morton curve whose digits are permuted (Ahmed & Wonka 2020, "Screen-Space
//! Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels").
//! Every pair of dimensions shuffles the index and scrambles the value by hashes of the dimension
//! (Burley 2020, "Practical Hash-based Owen Scrambling"). A number depends on (pixel, sample,
//! dimension, seed) and on nothing else.

use kilauea_math::Vec2;
use kilauea_math::hash::{combine, mix32, unit_f32};

/// The random numbers of one pixel sample, dimension by dimension.
#[derive(Clone, Debug)]
pub(crate) struct Sampler {
    index: u32,
    seed: u32,
    dimension: u32,
}

/// The run of the sequence that a pixel owns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelSequence {
    start: u64,
    seed: u32,
}

impl PixelSequence {
    /// The run of pixel (x, y) for up to `samples_per_pixel` samples.
    pub(crate) fn new(pixel: [i32; 2], samples_per_pixel: u32, seed: u32) -> Self {
        // Overscan makes coordinates negative: shift them into the unsigned range.
        let [x, y] = pixel.map(|c| c.wrapping_add(1 << 15) as u32 & 0xffff);
        let order = scramble_base4(interleave(x) | (interleave(y) << 1), seed);
        let log2_samples = samples_per_pixel.next_power_of_two().trailing_zeros();
        Self {
            start: (order as u64) << log2_samples,
            seed,
        }
    }

    /// The numbers of one sample.
    #[inline]
    pub(crate) fn sampler(&self, sample_idx: u32) -> Sampler {
        let index = self.start | sample_idx as u64;
        Sampler {
            index: index as u32,
            // Sobol indices have 32 bits; what lies above selects another scrambling.
            seed: combine(self.seed, (index >> 32) as u32),
            dimension: 0,
        }
    }
}

impl Sampler {
    /// The next two dimensions, each in [0, 1).
    #[inline]
    pub(crate) fn next_2d(&mut self) -> Vec2 {
        let key = combine(self.seed, self.dimension);
        self.dimension += 1;
        let shuffled = scramble_reversed(self.index.reverse_bits(), key).reverse_bits();
        let x = scramble_reversed(shuffled, mix32(key ^ 0xa511_e9b3));
        let y = scramble_reversed(second_sobol_reversed(shuffled), mix32(key ^ 0x63d8_3595));
        Vec2::new(unit_f32(x.reverse_bits()), unit_f32(y.reverse_bits()))
    }

    /// Continues with the dimensions of a bounce, whether or not earlier ones were used: skipping
    /// work never changes later numbers.
    #[inline]
    pub(crate) fn start_bounce(&mut self, bounce: u32) {
        self.dimension = Self::CAMERA_DIMENSIONS + bounce * Self::BOUNCE_DIMENSIONS;
    }

    /// A hash of this sample and `purpose`, for numbers that need no good distribution.
    #[inline]
    pub(crate) fn key(&self, purpose: u32) -> u32 {
        combine(combine(self.seed ^ 0x51ed_270b, purpose), self.index)
    }

    /// Pairs for the pixel filter and the lens.
    const CAMERA_DIMENSIONS: u32 = 2;
    /// Pairs for the point on a light, the direction, and the two choices.
    const BOUNCE_DIMENSIONS: u32 = 3;
}

/// Owen scrambling of a bit-reversed value: each bit is flipped by a hash of the lower ones
/// (Laine & Karras 2011, constants by Vegdahl 2021).
#[inline]
fn scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The bit-reversed second Sobol coordinate of an index: Pascal's matrix modulo two, applied as a
/// sum over supersets of bit positions. (The first coordinate, bit-reversed, is the index.)
#[inline]
fn second_sobol_reversed(mut x: u32) -> u32 {
    x ^= (x >> 1) & 0x5555_5555;
    x ^= (x >> 2) & 0x3333_3333;
    x ^= (x >> 4) & 0x0f0f_0f0f;
    x ^= (x >> 8) & 0x00ff_00ff;
    x ^ ((x >> 16) & 0x0000_ffff)
}

/// Spreads the 16 low bits to the even positions.
fn interleave(mut x: u32) -> u32 {
    x = (x | (x << 8)) & 0x00ff_00ff;
    x = (x | (x << 4)) & 0x0f0f_0f0f;
    x = (x | (x << 2)) & 0x3333_3333;
    (x | (x << 1)) & 0x5555_5555
}

/// Permutes each base-4 digit by a hash of the digits above it.
fn scramble_base4(x: u32, seed: u32) -> u32 {
    /// The 24 orders of four digits, two bits a digit.
    const PERMUTATIONS: [u8; 24] = permutations_of_4();
    (0..16).rev().fold(0, |scrambled, digit_idx| {
        let shift = 2 * digit_idx;
        let above = (x as u64 >> (shift + 2)) as u32;
        let hash = combine(combine(seed, above), digit_idx);
        let permutation = PERMUTATIONS[(hash % 24) as usize];
        let digit = (x >> shift) & 3;
        scrambled | ((permutation as u32 >> (2 * digit)) & 3) << shift
    })
}

const fn permutations_of_4() -> [u8; 24] {
    let mut table = [0; 24];
    let (mut n, mut code) = (0, 0);
    while code < 256 {
        let (a, b, c, d) = (code & 3, (code >> 2) & 3, (code >> 4) & 3, code >> 6);
        if a != b && a != c && a != d && b != c && b != d && c != d {
            table[n] = code as u8;
            n += 1;
        }
        code += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of a (0, m, 2)-net holds exactly one of 2^m consecutive points.
    fn check_is_net(points: &[Vec2]) {
        let m = points.len().ilog2();
        for log2_columns in 0..=m {
            let (columns, rows) = (1 << log2_columns, 1 << (m - log2_columns));
            let mut hits = vec![0; points.len()];
            for p in points {
                hits[(p.y * rows as f32) as usize * columns + (p.x * columns as f32) as usize] += 1;
            }
            assert!(hits.iter().all(|&n| n == 1), "{columns} x {rows}");
        }
    }

    #[test]
    fn each_pixel_and_dimension_is_a_net() {
        for pixel in [[0, 0], [5, 9], [-3, 70]] {
            let sequence = PixelSequence::new(pixel, 64, 7);
            for dimension in 0..5 {
                let points: Vec<Vec2> = (0..64)
                    .map(|sample| {
                        let mut s = sequence.sampler(sample);
                        (0..dimension).for_each(|_| {
                            s.next_2d();
                        });
                        s.next_2d()
                    })
                    .collect();
                check_is_net(&points);
            }
        }
    }

    #[test]
    fn a_block_of_pixels_shares_one_net() {
        // Four neighbours of four samples each make one net of sixteen points.
        let points: Vec<Vec2> = [[8, 4], [9, 4], [8, 5], [9, 5]]
            .into_iter()
            .flat_map(|pixel| {
                let sequence = PixelSequence::new(pixel, 4, 3);
                (0..4).map(move |i| sequence.sampler(i).next_2d())
            })
            .collect();
        check_is_net(&points);
    }

    #[test]
    fn pixels_seeds_and_dimensions_differ() {
        let first = |pixel, seed| PixelSequence::new(pixel, 16, seed).sampler(0).next_2d();
        assert_ne!(first([0, 0], 0), first([1, 0], 0));
        assert_ne!(first([0, 0], 0), first([0, 0], 1));
        let mut s = PixelSequence::new([0, 0], 16, 0).sampler(0);
        assert_ne!(s.next_2d(), s.next_2d());
    }
}
