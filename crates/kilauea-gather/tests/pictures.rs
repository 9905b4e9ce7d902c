//! What a rough picture says of samples.

#![forbid(unsafe_code)]

use kilauea_gather::{PictureEstimate, PictureSample};
use kilauea_math::hash::{combine, unit_f32};

const MIN: [i32; 2] = [-5, 3];
const MAX: [i32; 2] = [60, 40];

/// Two samples of each pixel: on the left half dark, on the right bright, and each off by up to
/// `spread` of that.
fn samples(spread: f32) -> Vec<PictureSample> {
    let pixels = (MIN[1]..MAX[1]).flat_map(|y| (MIN[0]..MAX[0]).map(move |x| [x, y]));
    let twice = pixels.flat_map(|pixel| [(pixel, 0), (pixel, 1)]);
    twice
        .map(|(pixel, i)| {
            let random = combine(combine(pixel[0] as u32, pixel[1] as u32), i);
            let luminance = if pixel[0] < 27 { 1.0 } else { 8.0 };
            PictureSample {
                pixel,
                luminance: luminance * (1.0 + spread * (2.0 * unit_f32(random) - 1.0)),
                n_rays: 5.0 + 2.0 * i as f32,
            }
        })
        .collect()
}

#[test]
fn brightness_is_that_of_the_place() {
    let picture = PictureEstimate::fit(MIN, MAX, &samples(0.5)).expect("there is light");
    for (pixel, luminance) in [
        ([-5, 3], 1.0),
        ([0, 20], 1.0),
        ([59, 39], 8.0),
        ([50, 10], 8.0),
    ] {
        let found = 1.0 / picture.per_luminance(pixel);
        // A floor of a tenth of the mean is added to the dark half.
        assert!(
            (found / luminance - 1.0).abs() < 0.15,
            "{found} at {pixel:?}"
        );
    }
}

#[test]
fn error_is_relative_variance() {
    let even = samples(0.5);
    let picture = PictureEstimate::fit(MIN, MAX, &even).expect("there is light");
    for spread in [0.0, 0.5, 1.0] {
        let error = picture
            .error_of(&samples(spread))
            .expect("there are samples");
        // The variance of numbers spread evenly over twice the spread.
        let expected = spread * spread / 3.0;
        let found = error.relative_variance;
        assert!(
            (found - expected).abs() <= 0.15 * expected,
            "{found} {expected}"
        );
        assert!((error.n_rays - 6.0).abs() < 1e-4);
    }
}

#[test]
fn no_single_sample_decides() {
    let sound = samples(0.5);
    let picture = PictureEstimate::fit(MIN, MAX, &sound).expect("there is light");
    let variance = |luminance| {
        let mut samples = sound.clone();
        samples[100].luminance = luminance;
        let error = picture.error_of(&samples).expect("there are samples");
        error.relative_variance
    };
    let without = picture.error_of(&sound).expect("there are samples");
    for luminance in [1e6, f32::INFINITY, f32::NAN] {
        let found = variance(luminance);
        assert!(found > without.relative_variance && found < 1.3 * without.relative_variance);
    }
}

#[test]
fn without_light_there_is_no_picture() {
    let mut dark = samples(0.5);
    for sample in &mut dark {
        sample.luminance = 0.0;
    }
    assert_eq!(PictureEstimate::fit(MIN, MAX, &dark), None);
    assert_eq!(PictureEstimate::fit(MIN, MAX, &[]), None);
    let picture = PictureEstimate::fit(MIN, MAX, &samples(0.5)).expect("there is light");
    assert_eq!(picture.error_of(&[]), None);
}

/// Samples whose expectations are 1 and 1.3 everywhere, each off by up to a half.
#[test]
fn what_is_expected_of_two_kinds_is_told_from_noise() {
    let plain = samples(0.5);
    let picture = PictureEstimate::fit(MIN, MAX, &plain).expect("there is light");
    let with_bias = |factor: f32, spread: f32| -> Vec<PictureSample> {
        let scaled = |sample: PictureSample| PictureSample {
            luminance: factor * sample.luminance,
            ..sample
        };
        samples(spread).into_iter().map(scaled).collect()
    };
    let difference = |a: &[PictureSample]| picture.squared_difference(&plain, a);
    let same = difference(&with_bias(1.0, -0.5)).expect("there are pixels");
    // The standard deviation is 0.007.
    assert!(same.value.abs() < 0.025, "{same:?}");
    assert!((0.004..0.01).contains(&same.standard_error), "{same:?}");
    let apart = difference(&with_bias(1.3, -0.5)).expect("there are pixels");
    // The floor below which errors are absolute makes a little less of the dark half.
    assert!((0.05..0.12).contains(&apart.value), "{apart:?}");
    assert_eq!(picture.squared_difference(&[], &[]), None);
}
