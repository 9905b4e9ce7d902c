//! What is known of the picture: how bright it is where, and how noisy its samples are.

/// What one path brought to its pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureSample {
    /// Column and row.
    pub pixel: [i32; 2],
    /// Luminance.
    pub luminance: f32,
    /// Rays traced.
    pub n_rays: f32,
}

/// How much paths err, and what they cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathError {
    /// Mean squared error of a path relative to the picture.
    pub relative_variance: f32,
    /// Mean number of rays of a path.
    pub n_rays: f32,
}

/// A rough picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureEstimate {
    min: [i32; 2],
    n_columns: usize,
    /// Mean luminance of squares of [`SQUARE`] pixels.
    luminance: Vec<f32>,
    /// Squared luminance below which errors are absolute.
    least_sq: f32,
}

/// Pixels on the side of a square whose brightness is taken to be even.
const SQUARE: i32 = 8;
/// Luminance over that of the whole picture below which errors are absolute.
const LEAST_LUMINANCE: f32 = 0.1;
/// Greatest square of what single paths and records bring or err by relative to the picture, so that no
/// single one decides.
pub(crate) const MAX_RELATIVE_SQ: f32 = 25.0;

/// What two kinds of samples are expected to differ by, squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquaredDifference {
    /// By chance it may be less than zero.
    pub value: f64,
    /// Of the value.
    pub standard_error: f64,
}

impl PictureEstimate {
    /// Fits to samples of pixels from `min` up to and without `max`. None where nothing is seen.
    pub fn fit(min: [i32; 2], max: [i32; 2], samples: &[PictureSample]) -> Option<Self> {
        let [n_columns, n_rows] =
            [0, 1].map(|axis| ((max[axis] - min[axis] + SQUARE - 1) / SQUARE).max(1) as usize);
        let mut sums = vec![(0.0_f64, 0.0_f64); n_columns * n_rows];
        let finite = |s: &&PictureSample| s.luminance.is_finite();
        let (mut total, mut n_samples) = (0.0, 0.0);
        for sample in samples.iter().filter(finite) {
            let sum = &mut sums[square(min, n_columns, sample.pixel)];
            sum.0 += f64::from(sample.luminance);
            sum.1 += 1.0;
            total += f64::from(sample.luminance);
            n_samples += 1.0;
        }
        let mean = (total / n_samples) as f32;
        // NaN without samples.
        if mean.is_nan() || mean <= 0.0 {
            return None;
        }
        Some(Self {
            min,
            n_columns,
            luminance: blurred(&sums, n_columns, n_rows, mean),
            least_sq: (LEAST_LUMINANCE * mean).powi(2),
        })
    }

    /// What samples, each two after each other of one pixel, tell of their paths; none without any.
    pub fn error_of(&self, samples: &[PictureSample]) -> Option<PathError> {
        let pairs = samples.chunks_exact(2);
        let n_pairs = pairs.len() as f64;
        let (mut variance, mut n_rays) = (0.0, 0.0);
        for pair in pairs {
            let difference = pair[0].luminance - pair[1].luminance;
            let relative = difference * self.per_luminance(pair[0].pixel);
            // NaN, which is not less, counts as the most.
            let relative_sq = MAX_RELATIVE_SQ.min(0.5 * relative * relative);
            variance += f64::from(relative_sq);
            n_rays += 0.5 * f64::from(pair[0].n_rays + pair[1].n_rays);
        }
        (n_pairs > 0.0).then(|| PathError {
            relative_variance: (variance / n_pairs) as f32,
            n_rays: (n_rays / n_pairs) as f32,
        })
    }

    /// Squared difference of what is expected of two kinds of samples relative to the picture, each two
    /// after each other of one pixel, which they have in common; none without any. Without bias, so
    /// that it may be less than zero: the differences of each pair are multiplied, which are independent.
    pub fn squared_difference(
        &self,
        a: &[PictureSample],
        b: &[PictureSample],
    ) -> Option<SquaredDifference> {
        let pairs = a.chunks_exact(2).zip(b.chunks_exact(2));
        let n_pairs = pairs.len() as f64;
        let product = |(a, b): (&[PictureSample], &[PictureSample])| {
            let per_luminance = self.per_luminance(a[0].pixel);
            let [first, second] = [0, 1].map(|i| (a[i].luminance - b[i].luminance) * per_luminance);
            f64::from(first * second)
        };
        let [sum, sum_of_squares] = pairs
            .map(product)
            .filter(|product| product.is_finite())
            .map(|product| product.clamp(-f64::from(MAX_RELATIVE_SQ), MAX_RELATIVE_SQ.into()))
            .fold([0.0, 0.0], |[sum, sq], x| [sum + x, sq + x * x]);
        (n_pairs > 0.0).then(|| {
            let value = sum / n_pairs;
            let variance = (sum_of_squares / n_pairs - value * value).max(0.0);
            SquaredDifference {
                value,
                standard_error: (variance / n_pairs).sqrt(),
            }
        })
    }

    /// What a luminance of one is relative to the picture at a pixel.
    #[inline]
    pub fn per_luminance(&self, pixel: [i32; 2]) -> f32 {
        let luminance = self.luminance[square(self.min, self.n_columns, pixel)];
        1.0 / (luminance * luminance + self.least_sq).sqrt()
    }
}

fn square(min: [i32; 2], n_columns: usize, pixel: [i32; 2]) -> usize {
    let [column, row] = [0, 1].map(|axis| ((pixel[axis] - min[axis]) / SQUARE) as usize);
    row * n_columns + column
}

/// Means over each square and those around it; `mean` where there are no samples.
fn blurred(sums: &[(f64, f64)], n_columns: usize, n_rows: usize, mean: f32) -> Vec<f32> {
    let around = |at: usize, n: usize| at.saturating_sub(1)..(at + 2).min(n);
    let value = |idx: usize| {
        let (column, row) = (idx % n_columns, idx / n_columns);
        let squares = around(row, n_rows)
            .flat_map(|row| around(column, n_columns).map(move |column| row * n_columns + column));
        let (sum, n) = squares.fold((0.0, 0.0), |(sum, n), idx| {
            (sum + sums[idx].0, n + sums[idx].1)
        });
        if n > 0.0 { (sum / n) as f32 } else { mean }
    };
    (0..sums.len()).map(value).collect()
}
