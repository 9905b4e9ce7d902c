//! HDR-FLIP: how visible the differences between two images are, seen in turn on a 0.7 m wide
//! display of 3840 pixels, 0.7 m away.
//!
//! Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images"; Andersson et al.
//! 2021, "Visualizing Errors in Rendered High Dynamic Range Images".

mod color;
mod convolve;
mod exposure;
mod ldr;

use rayon::prelude::*;

use exposure::{exposures, tone_map};
use ldr::Observer;

/// The largest FLIP of each pixel among the exposures that suit the reference: 0 where the images
/// are equal, at most 1. Images are rows of linear Rec. 709, finite; negative values count as zero.
///
/// # Panics
/// If an image does not have width times height pixels, `size` being both.
pub fn hdr_flip(test: &[[f32; 3]], reference: &[[f32; 3]], size: [usize; 2]) -> Vec<f32> {
    for image in [test, reference] {
        assert_eq!(image.len(), size[0] * size[1], "pixels of a {size:?} image");
    }
    let observer = Observer::new();
    let mut largest = vec![0.0f32; reference.len()];
    for exposure in exposures(reference) {
        let exposed = |image: &[[f32; 3]]| -> Vec<[f32; 3]> {
            image
                .par_iter()
                .map(|&rgb| tone_map(rgb, exposure))
                .collect()
        };
        let errors = observer.flip(&exposed(test), &exposed(reference), size);
        for (largest, error) in largest.iter_mut().zip(errors) {
            *largest = largest.max(error);
        }
    }
    largest
}

/// Mean of [`hdr_flip`] over the pixels.
pub(crate) fn mean_hdr_flip(test: &[[f32; 3]], reference: &[[f32; 3]], size: [usize; 2]) -> f64 {
    let errors = hdr_flip(test, reference, size);
    errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bars and a ramp with a bright spot, 48 x 32.
    fn reference(x: usize, y: usize) -> [f32; 3] {
        let (u, v) = (x as f32 / 48.0, y as f32 / 32.0);
        let bars = if (x / 6).is_multiple_of(2) { 0.8 } else { 0.2 };
        let spot = if (20..24).contains(&x) && (10..14).contains(&y) {
            12.0
        } else {
            0.0
        };
        [bars * (0.2 + v) + spot, 0.1 + u * v + spot, 0.6 * (1.0 - u)]
    }

    fn image(value: impl Fn(usize, usize) -> [f32; 3]) -> Vec<[f32; 3]> {
        (0..32 * 48).map(|i| value(i % 48, i / 48)).collect()
    }

    /// Expected values are those of the authors' `flip-evaluator` 1.7 for the same pixels.
    fn check(
        test: impl Fn(usize, usize) -> [f32; 3],
        reference: impl Fn(usize, usize) -> [f32; 3],
        expected: f64,
    ) {
        let flip = mean_hdr_flip(&image(test), &image(reference), [48, 32]);
        assert!(
            (flip - expected).abs() < 2e-5,
            "{flip} instead of {expected}"
        );
    }

    #[test]
    fn equal_images_have_none() {
        check(reference, reference, 0.0);
    }

    fn tinted(x: usize, y: usize) -> [f32; 3] {
        let [r, g, b] = reference(x, y);
        [1.1 * r, g, b + 0.05]
    }

    fn noisy(x: usize, y: usize) -> [f32; 3] {
        let scale = if (x + y).is_multiple_of(2) { 1.3 } else { 0.7 };
        reference(x, y).map(|v| v * scale)
    }

    fn mostly_black(x: usize, y: usize) -> [f32; 3] {
        if x < 30 { [0.0; 3] } else { reference(x, y) }
    }

    #[test]
    fn agrees_with_the_authors_program() {
        check(tinted, reference, 0.240_563_8);
        check(noisy, reference, 0.101_611_7);
        check(tinted, mostly_black, 0.788_228_5);
    }

    #[test]
    fn the_map_shows_where() {
        let marked = image(|x, y| {
            if (x, y) == (40, 8) {
                [5.0; 3]
            } else {
                reference(x, y)
            }
        });
        let errors = hdr_flip(&marked, &image(reference), [48, 32]);
        let worst = (0..errors.len()).max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        assert_eq!(worst, Some(8 * 48 + 40));
        assert!(errors[31 * 48] < 1e-6, "{}", errors[31 * 48]);
    }

    #[test]
    fn black_references_do_not_break_it() {
        let black = image(|_, _| [0.0; 3]);
        assert_eq!(mean_hdr_flip(&black, &black, [48, 32]), 0.0);
        let flip = mean_hdr_flip(&image(reference), &black, [48, 32]);
        assert!(flip > 0.3 && flip <= 1.0, "{flip}");
    }
}
