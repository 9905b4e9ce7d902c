//! How far an image is from a reference.

use serde::Serialize;

use crate::flip::mean_hdr_flip;
use crate::{Image, ImageError};

/// Differences between the red, green and blue of two images. Pixels in which either image is
/// not finite are counted and left out of everything else.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Mean of (a − b)² / (b² + 0.01).
    #[serde(rename = "relMSE")]
    pub rel_mse: f64,
    /// The same without the 0.1 % of pixels that are worst by it.
    #[serde(rename = "trimmed_relMSE")]
    pub trimmed_rel_mse: f64,
    /// Mean of (a − b)².
    #[serde(rename = "MSE")]
    pub mse: f64,
    /// Mean HDR-FLIP, 0 (equal) to 1.
    #[serde(rename = "mean_FLIP")]
    pub mean_flip: f64,
    /// Mean of `a` over the mean of `b`, by channel; one where both are zero.
    pub mean_ratio: [f64; 3],
    /// Values of either image that are NaN.
    pub nan: u64,
    /// Values of either image that are infinite.
    pub inf: u64,
}

/// Weighs errors in dark parts of the reference in [`Comparison::rel_mse`].
const REL_MSE_EPSILON: f64 = 1e-2;
/// Part of the pixels that [`Comparison::trimmed_rel_mse`] leaves out.
const TRIMMED_FRACTION: f64 = 1e-3;

/// Compares `a` with the reference `b` over their data windows, which must be the same.
pub fn compare(a: &Image, b: &Image) -> Result<Comparison, ImageError> {
    if a.data_window != b.data_window {
        return Err(ImageError::SizeMismatch {
            a: (a.size(), a.data_window.min),
            b: (b.size(), b.data_window.min),
        });
    }
    let size = a.size();
    let (mut a, mut b) = (pixels(a)?, pixels(b)?);
    if a.is_empty() {
        return Err(ImageError::Empty);
    }

    let values = || a.iter().chain(&b).flatten();
    let nan = values().filter(|v| v.is_nan()).count() as u64;
    let inf = values().filter(|v| v.is_infinite()).count() as u64;

    // Black in both images, a pixel adds no difference.
    let mut n_finite = 0u32;
    for (a, b) in a.iter_mut().zip(&mut b) {
        if a.iter().chain(b.iter()).all(|v| v.is_finite()) {
            n_finite += 1;
        } else {
            (*a, *b) = ([0.0; 3], [0.0; 3]);
        }
    }

    let mut squared = 0.0;
    let mut sums = [[0.0; 2]; 3];
    let mut relative: Vec<f64> = Vec::with_capacity(a.len());
    for (a, b) in a.iter().zip(&b) {
        let mut relative_of_pixel = 0.0;
        for ((&a, &b), sum) in a.iter().zip(b).zip(&mut sums) {
            let (a, b) = (f64::from(a), f64::from(b));
            let difference_sq = (a - b).powi(2);
            squared += difference_sq;
            relative_of_pixel += difference_sq / (b * b + REL_MSE_EPSILON);
            sum[0] += a;
            sum[1] += b;
        }
        relative.push(relative_of_pixel / 3.0);
    }

    let n = f64::from(n_finite.max(1));
    let n_trimmed = (n * TRIMMED_FRACTION) as usize;
    relative.sort_unstable_by(f64::total_cmp);
    let kept = &relative[..relative.len() - n_trimmed];
    Ok(Comparison {
        rel_mse: relative.iter().sum::<f64>() / n,
        trimmed_rel_mse: kept.iter().sum::<f64>() / (n - n_trimmed as f64),
        mse: squared / (3.0 * n),
        mean_flip: mean_hdr_flip(&a, &b, size),
        mean_ratio: sums.map(|[a, b]| if a == b { 1.0 } else { a / b }),
        nan,
        inf,
    })
}

fn pixels(image: &Image) -> Result<Vec<[f32; 3]>, ImageError> {
    let [r, g, b] = image.rgb()?;
    Ok(r.iter()
        .zip(g)
        .zip(b)
        .map(|((&r, &g), &b)| [r, g, b])
        .collect())
}

#[cfg(test)]
mod tests {
    use kilauea_scene::DataWindow;

    use super::*;
    use crate::Channel;

    const SIZE: usize = 40;

    fn image(value: impl Fn(usize) -> f32) -> Image {
        Image {
            resolution: [SIZE as u32; 2],
            data_window: DataWindow {
                min: [0, 0],
                max: [SIZE as i32; 2],
            },
            channels: ["R", "G", "B"]
                .map(|name| Channel {
                    name: name.into(),
                    samples: (0..SIZE * SIZE).map(&value).collect(),
                })
                .to_vec(),
        }
    }

    fn check_near(found: f64, expected: f64) {
        assert!(
            (found - expected).abs() <= 1e-6 * expected.abs(),
            "{found} instead of {expected}"
        );
    }

    #[test]
    fn equal_images_do_not_differ() {
        let a = image(|i| i as f32);
        let same = compare(&a, &a).unwrap();
        assert_eq!(
            same,
            Comparison {
                rel_mse: 0.0,
                trimmed_rel_mse: 0.0,
                mse: 0.0,
                mean_flip: 0.0,
                mean_ratio: [1.0; 3],
                nan: 0,
                inf: 0,
            }
        );
        assert_eq!(compare(&image(|_| 0.0), &image(|_| 0.0)).unwrap(), same);
    }

    #[test]
    fn a_uniform_error_has_the_value_of_the_formula() {
        let c = compare(&image(|_| 0.75), &image(|_| 0.5)).unwrap();
        check_near(c.mse, 0.0625);
        check_near(c.rel_mse, 0.0625 / 0.26);
        check_near(c.trimmed_rel_mse, c.rel_mse);
        check_near(c.mean_ratio[1], 1.5);
        assert!(c.mean_flip > 0.05 && c.mean_flip < 1.0, "{}", c.mean_flip);
    }

    #[test]
    fn the_reference_is_the_second() {
        let c = compare(&image(|_| 0.5), &image(|_| 0.0)).unwrap();
        check_near(c.rel_mse, 25.0);
        assert_eq!(c.mean_ratio[0], f64::INFINITY);
    }

    #[test]
    fn trimming_drops_a_firefly() {
        let a = image(|i| if i == 77 { 1e4 } else { 1.1 });
        let c = compare(&a, &image(|_| 1.0)).unwrap();
        check_near(c.trimmed_rel_mse, f64::from(1.1f32 - 1.0).powi(2) / 1.01);
        assert!(c.rel_mse > 1e4);
    }

    #[test]
    fn what_is_not_finite_is_counted_and_left_out() {
        let a = image(|i| match i {
            3 => f32::NAN,
            4 => f32::INFINITY,
            _ => 0.75,
        });
        let c = compare(&a, &image(|_| 0.5)).unwrap();
        assert_eq!([c.nan, c.inf], [3, 3]);
        check_near(c.mse, 0.0625);
        check_near(c.mean_ratio[2], 1.5);
        assert!(c.mean_flip.is_finite());

        let none = compare(&image(|_| f32::NAN), &a).unwrap();
        assert_eq!(none.mse, 0.0);
        assert_eq!(none.nan, 3 * (SIZE * SIZE) as u64 + 3);
    }

    #[test]
    fn different_windows_are_an_error() {
        let a = image(|_| 0.0);
        let mut b = a.clone();
        b.data_window.min = [1, 0];
        for channel in &mut b.channels {
            channel.samples.truncate((SIZE - 1) * SIZE);
        }
        let error = compare(&a, &b).unwrap_err().to_string();
        assert!(
            error.contains("40x40 at [0, 0] and 39x40 at [1, 0]"),
            "{error}"
        );
    }

    #[test]
    fn json_has_the_agreed_names() {
        let c = compare(&image(|_| 0.5), &image(|_| 0.5)).unwrap();
        assert_eq!(
            serde_json::to_string(&c).unwrap(),
            r#"{"relMSE":0.0,"trimmed_relMSE":0.0,"MSE":0.0,"mean_FLIP":0.0,"mean_ratio":[1.0,1.0,1.0],"nan":0,"inf":0}"#
        );
    }
}
