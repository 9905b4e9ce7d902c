//! FLIP of two displayed images (Andersson et al. 2020, section 4).

use rayon::prelude::*;

use super::color::{Colors, hyab};
use super::convolve::{along_x, along_y};

/// Pixels per degree of the observer's field of view.
const PIXELS_PER_DEGREE: f32 = 0.7 * 3840.0 / 0.7 * std::f32::consts::PI / 180.0;
/// Exponent of color differences.
const COLOR_EXPONENT: f32 = 0.7;
/// Exponent of feature differences.
const FEATURE_EXPONENT: f32 = 0.5;
/// Color differences up to this part of the largest one ...
const KNEE: f32 = 0.4;
/// ... take this part of the range of errors.
const KNEE_ERROR: f32 = 0.95;
/// Peak to trough of the eye's edge detector in degrees.
const FEATURE_WIDTH: f32 = 0.082;

/// Contrast sensitivity of the achromatic, red-green and blue-yellow channels, each a sum of two
/// Gaussians in space given by (weight a, spread b); the first two have only one.
const SENSITIVITY: [(f32, f32); 4] = [(1.0, 0.0047), (1.0, 0.0053), (34.1, 0.04), (13.5, 0.025)];

/// What FLIP knows about the eye, tabulated.
pub(super) struct Observer {
    colors: Colors,
    blur_radius: usize,
    /// Weights of the four Gaussians of [`SENSITIVITY`], each of unit sum.
    blur: Vec<[f32; 4]>,
    /// Shares of the two blue-yellow Gaussians.
    blue_yellow: [f32; 2],
    feature_radius: usize,
    /// A Gaussian and its first and second derivatives.
    feature: Vec<[f32; 3]>,
    /// The largest color difference, raised to [`COLOR_EXPONENT`].
    largest: f32,
}

impl Observer {
    pub(super) fn new() -> Self {
        let colors = Colors::new();
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| colors.hunt_lab(rgb));

        // Gaussians of the contrast sensitivity, to three standard deviations of the widest.
        let pi_sq = std::f32::consts::PI.powi(2);
        let widest = SENSITIVITY.map(|(_, b)| b).into_iter().fold(0.0, f32::max);
        let blur_radius = (3.0 * (widest / (2.0 * pi_sq)).sqrt() * PIXELS_PER_DEGREE).ceil();
        let mut blur: Vec<[f32; 4]> = positions(blur_radius)
            .map(|x| SENSITIVITY.map(|(_, b)| (-pi_sq * (x / PIXELS_PER_DEGREE).powi(2) / b).exp()))
            .collect();
        let sums = [0, 1, 2, 3].map(|i| blur.iter().map(|w| w[i]).sum::<f32>());
        for weights in &mut blur {
            for (weight, sum) in weights.iter_mut().zip(sums) {
                *weight /= sum;
            }
        }
        let share = |i: usize| {
            let (a, b) = SENSITIVITY[i];
            a * (std::f32::consts::PI / b).sqrt() * sums[i] * sums[i]
        };
        let both = share(2) + share(3);

        // Edge and point detectors: positive weights add up to one, negative to minus one.
        let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let feature_radius = (3.0 * deviation).ceil();
        let mut feature: Vec<[f32; 3]> = positions(feature_radius)
            .map(|x| {
                let t = x / deviation;
                let gaussian = (-0.5 * t * t).exp();
                [gaussian, -t * gaussian, (t * t - 1.0) * gaussian]
            })
            .collect();
        for i in 0..3 {
            let sum_of =
                |sign: f32| -> f32 { feature.iter().map(|w| (sign * w[i]).max(0.0)).sum() };
            let (positive, negative) = (sum_of(1.0), sum_of(-1.0));
            for weights in &mut feature {
                weights[i] /= if weights[i] < 0.0 { negative } else { positive };
            }
        }

        Self {
            colors,
            blur_radius: blur_radius as usize,
            blur,
            blue_yellow: [share(2) / both, share(3) / both],
            feature_radius: feature_radius as usize,
            feature,
            largest: hyab(green, blue).powf(COLOR_EXPONENT),
        }
    }

    /// The error of every pixel, 0 to 1. Images are display-linear Rec. 709 in [0, 1].
    pub(super) fn flip(
        &self,
        test: &[[f32; 3]],
        reference: &[[f32; 3]],
        size: [usize; 2],
    ) -> Vec<f32> {
        let (test, reference) = (self.see(test, size), self.see(reference, size));
        test.par_iter()
            .zip(&reference)
            .map(|(a, b)| {
                let color = self.color_error(a.color, b.color);
                let feature = (a.edge - b.edge).abs().max((a.point - b.point).abs());
                let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT);
                color.powf(1.0 - feature)
            })
            .collect()
    }

    fn see(&self, image: &[[f32; 3]], [width, _]: [usize; 2]) -> Vec<Seen> {
        let opponent: Vec<[f32; 3]> = image
            .par_iter()
            .map(|&rgb| self.colors.opponent(rgb))
            .collect();
        let colors = self.blurred(&opponent, width);
        let features = self.features(&opponent, width);
        colors
            .into_par_iter()
            .zip(features)
            .map(
                |([y, cx, cz_wide, cz_narrow], [edge_x, edge_y, point_x, point_y])| {
                    let cz = self.blue_yellow[0] * cz_wide + self.blue_yellow[1] * cz_narrow;
                    let rgb = self.colors.displayable([y, cx, cz]);
                    Seen {
                        color: self.colors.hunt_lab(rgb),
                        edge: edge_x.hypot(edge_y),
                        point: point_x.hypot(point_y),
                    }
                },
            )
            .collect()
    }

    /// The opponent channels through the Gaussians of [`SENSITIVITY`].
    fn blurred(&self, opponent: &[[f32; 3]], width: usize) -> Vec<[f32; 4]> {
        let blur = &self.blur;
        let rows = along_x(
            opponent,
            width,
            self.blur_radius,
            |k, [y, cx, cz], sum: &mut [f32; 4]| {
                for (sum, (weight, value)) in
                    sum.iter_mut().zip(blur[k].iter().zip([y, cx, cz, cz]))
                {
                    *sum += weight * value;
                }
            },
        );
        along_y(
            &rows,
            width,
            self.blur_radius,
            |k, value, sum: &mut [f32; 4]| {
                for (sum, (weight, value)) in sum.iter_mut().zip(blur[k].iter().zip(value)) {
                    *sum += weight * value;
                }
            },
        )
    }

    /// Edges across x and y, then points across x and y, of the achromatic channel.
    fn features(&self, opponent: &[[f32; 3]], width: usize) -> Vec<[f32; 4]> {
        let feature = &self.feature;
        let rows = along_x(
            opponent,
            width,
            self.feature_radius,
            |k, [y, _, _], sum: &mut [f32; 3]| {
                for (sum, weight) in sum.iter_mut().zip(feature[k]) {
                    *sum += weight * y;
                }
            },
        );
        along_y(
            &rows,
            width,
            self.feature_radius,
            |k, [gaussian, first, second], sum: &mut [f32; 4]| {
                let weight = feature[k];
                sum[0] += weight[0] * first;
                sum[1] += weight[1] * gaussian;
                sum[2] += weight[0] * second;
                sum[3] += weight[2] * gaussian;
            },
        )
    }

    /// The error of a color difference: exponent, then a knee that keeps small ones apart.
    fn color_error(&self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let distance = hyab(a, b).powf(COLOR_EXPONENT);
        let knee = KNEE * self.largest;
        if distance < knee {
            KNEE_ERROR / knee * distance
        } else {
            KNEE_ERROR + (distance - knee) / (self.largest - knee) * (1.0 - KNEE_ERROR)
        }
    }
}

/// What the observer sees at a pixel.
struct Seen {
    color: [f32; 3],
    edge: f32,
    point: f32,
}

/// -radius to radius.
fn positions(radius: f32) -> impl Iterator<Item = f32> {
    let n = radius as i32;
    (-n..=n).map(|x| x as f32)
}
