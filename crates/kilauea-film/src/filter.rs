//! Pixel filters, sampled rather than splatted: every sample weighs the same and belongs to one
//! pixel, so that pixels stay uncorrelated (Ernst et al. 2006, "Filter importance sampling").

use kilauea_math::Vec2;
use kilauea_scene::FilterKind;

/// Intervals of the tabulated quantile function.
const N_INTERVALS: usize = 1024;
/// Wider filters than this many pixels serve no one and are narrowed to it.
const MAX_RADIUS: f32 = 64.0;

/// A separable, symmetric pixel filter from which sample positions are drawn.
#[derive(Clone, Debug)]
pub struct Filter {
    kind: FilterKind,
    radius: f32,
    /// Distance from the center as a function of the square root of the probability of being
    /// farther out, at `N_INTERVALS + 1` even steps. The root makes the outer part of a filter
    /// that falls to zero nearly linear. Empty for the box.
    quantiles: Vec<f32>,
    /// Integral of the profile along an axis.
    volume: f32,
}

impl Filter {
    /// A filter of a kind; without a radius (in pixels), of the kind's own. A radius that is not
    /// a positive number puts every sample on the pixel center.
    pub fn new(kind: FilterKind, radius: Option<f32>) -> Self {
        let radius = match radius.unwrap_or(default_radius(kind)) {
            positive if positive > 0.0 => positive.min(MAX_RADIUS),
            _ => 0.0,
        };
        Self {
            kind,
            radius,
            quantiles: match kind {
                FilterKind::Box => Vec::new(),
                FilterKind::Gaussian | FilterKind::BlackmanHarris => tabulate(kind, radius),
            },
            volume: volume(kind, radius),
        }
    }

    /// Which filter this is.
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// Largest offset along each axis in pixels.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The offset of a sample from the pixel center in pixels, for `u` in [0, 1)²; its density is
    /// the filter itself. Monotonic in each coordinate, so stratification of `u` is kept.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec2 {
        Vec2::new(self.offset(u.x), self.offset(u.y))
    }

    /// A pixel that a point of the picture (in pixels) counts for, drawn by `u` in [0, 1)² in proportion to
    /// how much it does; and the sum of that over all pixels. None where it counts for none, as with a filter
    /// without extent.
    pub fn pixel_around(&self, raster: Vec2, u: Vec2) -> Option<([i32; 2], f32)> {
        let (x, of_x) = self.place_around(raster.x, u.x)?;
        let (y, of_y) = self.place_around(raster.y, u.y)?;
        Some(([x, y], of_x * of_y))
    }

    /// The same along one axis.
    fn place_around(&self, at: f32, u: f32) -> Option<(i32, f32)> {
        if self.radius == 0.0 || !at.is_finite() {
            return None;
        }
        let first = (at - 0.5 - self.radius).ceil() as i32;
        let last = (at - 0.5 + self.radius).floor() as i32;
        let density = |pixel: i32| self.density(at - (pixel as f32 + 0.5));
        let sum: f32 = (first..=last).map(density).sum();
        let mut left = u * sum;
        let mut drawn = None;
        for pixel in first..=last {
            let density = density(pixel);
            if density > 0.0 {
                drawn = Some(pixel);
            }
            left -= density;
            if left < 0.0 {
                break;
            }
        }
        drawn.map(|pixel| (pixel, sum))
    }

    /// Density of offsets along an axis, per pixel.
    fn density(&self, offset: f32) -> f32 {
        if offset < -self.radius || offset >= self.radius {
            return 0.0;
        }
        let [distance, radius] = [offset.abs(), self.radius].map(f64::from);
        let value = profile(self.kind, distance, radius).max(0.0);
        value as f32 / self.volume
    }

    #[inline]
    fn offset(&self, u: f32) -> f32 {
        let signed = 2.0 * u - 1.0;
        if self.quantiles.is_empty() {
            return self.radius * signed;
        }

        // Interpolate between the two quantiles around the root of the outer probability.
        let at = (1.0 - signed.abs()).max(0.0).sqrt() * N_INTERVALS as f32;
        let idx = (at as usize).min(N_INTERVALS - 1);
        let t = at - idx as f32;
        let distance = self.quantiles[idx] * (1.0 - t) + self.quantiles[idx + 1] * t;
        distance.copysign(signed)
    }
}

/// Radius in pixels of a filter that is given none.
fn default_radius(kind: FilterKind) -> f32 {
    match kind {
        FilterKind::Box => 0.5,
        FilterKind::Gaussian | FilterKind::BlackmanHarris => 1.5,
    }
}

/// Value of a filter at distance `x` from the center, 0 <= x <= radius; not normalized.
fn profile(kind: FilterKind, x: f64, radius: f64) -> f64 {
    match kind {
        FilterKind::Box => 1.0,
        // Standard deviation a third of the radius, lowered to reach zero there (PBR 4ed., 8.8.3).
        FilterKind::Gaussian => {
            let gaussian = |d: f64| (-4.5 * (d / radius).powi(2)).exp();
            gaussian(x) - gaussian(radius)
        }
        // Four-term window with 92 dB of side lobe suppression (Harris 1978, table I).
        FilterKind::BlackmanHarris => {
            let phase = std::f64::consts::PI * x / radius;
            0.35875
                + 0.48829 * phase.cos()
                + 0.14128 * (2.0 * phase).cos()
                + 0.01168 * (3.0 * phase).cos()
        }
    }
}

/// Integral of a filter along an axis, by the midpoint rule.
fn volume(kind: FilterKind, radius: f32) -> f32 {
    const N_STEPS: u32 = 1024;
    let radius = f64::from(radius);
    let step = radius / f64::from(N_STEPS);
    let at = |i: u32| profile(kind, (f64::from(i) + 0.5) * step, radius).max(0.0);
    (2.0 * step * (0..N_STEPS).map(at).sum::<f64>()) as f32
}

/// The table behind [`Filter::sample`].
fn tabulate(kind: FilterKind, radius: f32) -> Vec<f32> {
    const N_CELLS: usize = 1 << 14;
    let radius = f64::from(radius);
    let width = radius / N_CELLS as f64;
    let edge = |cell: usize| cell as f64 * width;

    // Integrate from the rim inwards, Simpson's rule in each cell.
    let mut outer = vec![0.0; N_CELLS + 1];
    for cell in (0..N_CELLS).rev() {
        let [a, m, b] =
            [0.0, 0.5, 1.0].map(|t| profile(kind, edge(cell) + t * width, radius).max(0.0));
        outer[cell] = outer[cell + 1] + (a + 4.0 * m + b);
    }

    // Invert: where is the probability of being farther out (step / N)^2?
    let mut cell = N_CELLS - 1;
    (0..=N_INTERVALS)
        .map(|step| {
            let target = (step as f64 / N_INTERVALS as f64).powi(2) * outer[0];
            while cell > 0 && outer[cell] < target {
                cell -= 1;
            }
            let in_cell = outer[cell] - outer[cell + 1];
            let t = if in_cell > 0.0 {
                ((outer[cell] - target) / in_cell).clamp(0.0, 1.0)
            } else {
                1.0
            };
            ((cell as f64 + t) * width) as f32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [FilterKind; 3] = [
        FilterKind::Box,
        FilterKind::Gaussian,
        FilterKind::BlackmanHarris,
    ];

    #[test]
    fn points_count_for_pixels_as_samples_of_those_fall_on_them() {
        const N: usize = 100_000;
        for (kind, radius) in KINDS.into_iter().flat_map(|k| [(k, None), (k, Some(2.2))]) {
            let filter = Filter::new(kind, radius);
            // Which points near pixel 7 count for it, by either way, in tenths of pixels.
            let mut by_samples = [0.0; 60];
            for offset in offsets(&filter, N) {
                by_samples[((offset + 3.0) * 10.0) as usize] += 1.0 / N as f64;
            }
            let mut by_points = [0.0; 60];
            for i in 0..N {
                let at = (i as f64 + 0.5) / N as f64 * 6.0;
                let u = (i as f32 * 0.618_034).fract();
                let drawn = filter.place_around(at as f32 + 4.5, u);
                if let Some((7, sum)) = drawn {
                    by_points[(at * 10.0) as usize] += f64::from(sum) * 6.0 / N as f64;
                }
            }
            for (cell, (a, b)) in by_samples.iter().zip(by_points).enumerate() {
                assert!((a - b).abs() < 3e-3, "{kind:?} {radius:?} {cell}: {a} {b}");
            }
        }
        let pixel =
            Filter::new(FilterKind::Box, None).pixel_around(Vec2::new(2.5, -0.25), Vec2::ZERO);
        assert_eq!(pixel, Some(([2, -1], 1.0)));
        assert_eq!(
            Filter::new(FilterKind::Box, Some(0.0)).pixel_around(Vec2::ONE, Vec2::ZERO),
            None
        );
    }

    /// Even steps through [0, 1): what a perfectly stratified sampler would ask for.
    fn offsets(filter: &Filter, n: usize) -> impl Iterator<Item = f64> {
        (0..n).map(move |i| f64::from(filter.sample(Vec2::splat((i as f32 + 0.5) / n as f32)).x))
    }

    /// Integral of `weight(x)` times the filter over [a, b].
    fn integrate(filter: &Filter, a: f64, b: f64, weight: impl Fn(f64) -> f64) -> f64 {
        let n = 2000;
        let radius = f64::from(filter.radius());
        (0..n)
            .map(|i| a + (i as f64 + 0.5) / n as f64 * (b - a))
            .map(|x| weight(x) * profile(filter.kind(), x.abs(), radius))
            .sum::<f64>()
            * (b - a)
            / n as f64
    }

    fn check_moments(filter: &Filter) {
        let n = 1 << 16;
        let radius = f64::from(filter.radius());
        let mean = offsets(filter, n).sum::<f64>() / n as f64;
        assert!(mean.abs() < 1e-6 * radius, "{filter:?}: mean {mean}");

        let variance = offsets(filter, n).map(|x| x * x).sum::<f64>() / n as f64;
        let expected = integrate(filter, -radius, radius, |x| x * x)
            / integrate(filter, -radius, radius, |_| 1.0);
        assert!(
            (variance / expected - 1.0).abs() < 1e-4,
            "{:?}: variance {variance}, expected {expected}",
            filter.kind()
        );
    }

    /// Every bin of a fine histogram, down to the thin tails, holds what the filter says.
    fn check_histogram(filter: &Filter) {
        const N_BINS: usize = 200;
        let n = 1 << 20;
        let radius = f64::from(filter.radius());
        let mut counts = [0u32; N_BINS];
        for x in offsets(filter, n) {
            assert!(x.abs() <= radius);
            let bin = (x / radius + 1.0) * 0.5 * N_BINS as f64;
            counts[(bin as usize).min(N_BINS - 1)] += 1;
        }
        let total = integrate(filter, -radius, radius, |_| 1.0);
        for (bin, &count) in counts.iter().enumerate() {
            let edge = |i: usize| (2.0 * i as f64 / N_BINS as f64 - 1.0) * radius;
            let expected = integrate(filter, edge(bin), edge(bin + 1), |_| 1.0) / total;
            let found = f64::from(count) / n as f64;
            let tolerance = 0.005 * expected + 3.0 / n as f64;
            assert!(
                (found - expected).abs() < tolerance,
                "{:?} bin {bin}: {found} instead of {expected}",
                filter.kind()
            );
        }
    }

    #[test]
    fn moments_are_the_filters() {
        for kind in KINDS {
            check_moments(&Filter::new(kind, None));
            check_moments(&Filter::new(kind, Some(2.25)));
        }
    }

    #[test]
    fn histograms_are_the_filters() {
        for kind in KINDS {
            check_histogram(&Filter::new(kind, None));
        }
    }

    #[test]
    fn blackman_harris_has_its_closed_form_variance() {
        // Integrate x² cos(k pi x / r) by parts over [-r, r].
        let sum = -0.48829 + 0.14128 / 4.0 - 0.01168 / 9.0;
        let pi_sq = std::f64::consts::PI.powi(2);
        let expected = 4.0 * 1.5f64.powi(2) * (1.0 / 12.0 + sum / (2.0 * pi_sq * 0.35875));
        let filter = Filter::new(FilterKind::BlackmanHarris, None);
        let n = 1 << 16;
        let variance = offsets(&filter, n).map(|x| x * x).sum::<f64>() / n as f64;
        assert!(
            (variance - expected).abs() < 1e-5,
            "{variance} instead of {expected}"
        );
    }

    #[test]
    fn offsets_grow_with_u() {
        for kind in KINDS {
            let filter = Filter::new(kind, None);
            let all: Vec<f64> = offsets(&filter, 1 << 14).collect();
            assert!(all.windows(2).all(|w| w[0] < w[1]), "{kind:?}");
        }
    }

    #[test]
    fn bad_radii_sample_the_center() {
        for kind in KINDS {
            for radius in [0.0, -1.0, f32::NAN] {
                let filter = Filter::new(kind, Some(radius));
                let offset = filter.sample(Vec2::new(0.1, 0.9));
                assert_eq!(offset.abs(), Vec2::ZERO, "{kind:?} {radius}");
            }
            assert!(
                Filter::new(kind, Some(f32::INFINITY))
                    .sample(Vec2::ZERO)
                    .is_finite()
            );
        }
    }
}
