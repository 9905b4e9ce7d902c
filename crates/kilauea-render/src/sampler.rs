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

/// What all pixels of a frame share: the scrambling of each pair of dimensions.
#[derive(Clone, Debug)]
pub(crate) struct SamplerTables {
    seed: u32,
    log2_samples: u32,
    pairs: Vec<PairKeys>,
    time: PairKeys,
}

/// Scrambling of one pair of dimensions.
#[derive(Clone, Copy, Debug)]
struct PairKeys {
    index: u32,
    x: u32,
    y: u32,
}

/// The run of the sequence that a pixel owns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelSequence<'a> {
    tables: &'a SamplerTables,
    start: u64,
}

/// The random numbers of one pixel sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampler<'a> {
    tables: &'a SamplerTables,
    reversed_index: u32,
    /// Selects another scrambling where the index needs more than the 32 bits of a Sobol index.
    above: u32,
}

/// What a pair of numbers is for. Each purpose has its own dimensions whether or not others are
/// asked for, so skipping work never changes the numbers of the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Point of the pixel filter.
    Filter,
    /// Point on the lens.
    Lens,
    /// When, while the shutter is open; only x is used.
    Time,
    /// Point on a light, at the vertex after so many bounces.
    Light(u32),
    /// Direction that a path takes.
    Direction(u32),
    /// Which light, and which lobe.
    Choice(u32),
    /// Which light a photon leaves.
    EmittingLight,
    /// Direction in which a photon leaves its light.
    EmittedDirection,
    /// Point from which a photon leaves its light.
    EmittedPoint,
}

/// Stands apart, so that it moves no other dimension.
const TIME_PAIR: u32 = u32::MAX;

impl Purpose {
    fn pair(self) -> u32 {
        match self {
            Self::Time => TIME_PAIR,
            // Photons have no filter, no lens, and choose no light where they arrive.
            Self::Filter | Self::EmittedPoint => 0,
            Self::Lens | Self::EmittedDirection => 1,
            Self::EmittingLight => Self::Light(0).pair(),
            Self::Light(bounce) => 2 + 3 * bounce,
            Self::Direction(bounce) => 3 + 3 * bounce,
            Self::Choice(bounce) => 4 + 3 * bounce,
        }
    }
}

impl SamplerTables {
    /// Tables for paths of up to `max_depth` bounces.
    pub(crate) fn new(samples_per_pixel: u32, max_depth: u32, seed: u32) -> Self {
        let n_pairs = Purpose::Choice(max_depth).pair() + 1;
        let keys = |pair| {
            let index = combine(seed, pair);
            PairKeys {
                index,
                x: mix32(index ^ 0xa511_e9b3),
                y: mix32(index ^ 0x63d8_3595),
            }
        };
        Self {
            seed,
            log2_samples: samples_per_pixel.next_power_of_two().trailing_zeros(),
            pairs: (0..n_pairs).map(keys).collect(),
            time: keys(TIME_PAIR),
        }
    }

    /// The run of pixel (x, y).
    pub(crate) fn pixel(&self, pixel: [i32; 2]) -> PixelSequence<'_> {
        // Overscan makes coordinates negative: shift them into the unsigned range.
        let [x, y] = pixel.map(|c| c.wrapping_add(1 << 15) as u32 & 0xffff);
        let order = scramble_base4(interleave(x) | (interleave(y) << 1), self.seed);
        PixelSequence {
            tables: self,
            start: (order as u64) << self.log2_samples,
        }
    }
}

impl<'a> PixelSequence<'a> {
    /// The numbers of one sample.
    #[inline]
    pub(crate) fn sampler(&self, sample_idx: u32) -> Sampler<'a> {
        let index = self.start | sample_idx as u64;
        let above = (index >> 32) as u32;
        Sampler {
            tables: self.tables,
            reversed_index: (index as u32).reverse_bits(),
            above: if above == 0 { 0 } else { mix32(above) },
        }
    }
}

impl Sampler<'_> {
    /// Two numbers, each in [0, 1).
    // Which dimension it is, is known where it is called.
    #[inline(always)]
    pub(crate) fn pair(&self, purpose: Purpose) -> Vec2 {
        let keys = match purpose {
            Purpose::Time => &self.tables.time,
            _ => &self.tables.pairs[purpose.pair() as usize],
        };
        let shuffled =
            scramble_reversed(self.reversed_index, keys.index ^ self.above).reverse_bits();
        let x = scramble_reversed(shuffled, keys.x);
        let y = scramble_reversed(second_sobol_reversed(shuffled), keys.y);
        // Both are reversed at once.
        let reversed = ((x as u64) << 32 | y as u64).reverse_bits();
        Vec2::new(unit_f32(reversed as u32), unit_f32((reversed >> 32) as u32))
    }

    /// A hash of this sample and `purpose`, for numbers that need no good distribution.
    #[inline]
    pub(crate) fn key(&self, purpose: u32) -> u32 {
        let seed = self.tables.seed ^ self.above ^ 0x51ed_270b;
        combine(combine(seed, purpose), self.reversed_index)
    }
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
    fn each_pixel_and_pair_is_a_net() {
        let tables = SamplerTables::new(64, 3, 7);
        for pixel in [[0, 0], [5, 9], [-3, 70]] {
            let sequence = tables.pixel(pixel);
            for purpose in [Purpose::Filter, Purpose::Time, Purpose::Choice(3)] {
                let points: Vec<Vec2> =
                    (0..64).map(|i| sequence.sampler(i).pair(purpose)).collect();
                check_is_net(&points);
            }
        }
    }

    #[test]
    fn a_block_of_pixels_shares_one_net() {
        // Four neighbours of four samples each make one net of sixteen points.
        let tables = SamplerTables::new(4, 1, 3);
        let points: Vec<Vec2> = [[8, 4], [9, 4], [8, 5], [9, 5]]
            .into_iter()
            .flat_map(|pixel| {
                let sequence = tables.pixel(pixel);
                (0..4).map(move |i| sequence.sampler(i).pair(Purpose::Direction(0)))
            })
            .collect();
        check_is_net(&points);
    }

    #[test]
    fn pixels_seeds_and_purposes_differ() {
        let first = |pixel, seed, purpose| {
            SamplerTables::new(16, 2, seed)
                .pixel(pixel)
                .sampler(0)
                .pair(purpose)
        };
        let reference = first([0, 0], 0, Purpose::Filter);
        assert_ne!(reference, first([1, 0], 0, Purpose::Filter));
        assert_ne!(reference, first([0, 0], 1, Purpose::Filter));
        assert_ne!(reference, first([0, 0], 0, Purpose::Direction(0)));
    }

    #[test]
    fn many_samples_of_large_pictures_do_not_repeat() {
        let tables = SamplerTables::new(1 << 16, 1, 0);
        let first = |pixel| tables.pixel(pixel).sampler(0).pair(Purpose::Filter);
        let points: std::collections::BTreeSet<[u32; 2]> = (0..4096)
            .map(|i| {
                first([16 * (i % 64), 16 * (i / 64)])
                    .to_array()
                    .map(f32::to_bits)
            })
            .collect();
        assert!(points.len() > 4000, "{}", points.len());
    }
}
