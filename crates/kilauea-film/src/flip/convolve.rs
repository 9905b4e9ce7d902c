//! One-dimensional convolutions; pixels beyond the border equal the ones on it.

use rayon::prelude::*;

/// Convolves along the rows. `tap(k, value, sum)` adds what the pixel `k - radius` columns away
/// contributes; `I` and `O` are the channels of the image and of the result.
pub(super) fn along_x<const I: usize, const O: usize>(
    image: &[[f32; I]],
    width: usize,
    radius: usize,
    tap: impl Fn(usize, &[f32; I], &mut [f32; O]) + Sync,
) -> Vec<[f32; O]> {
    let mut out = vec![[0.0; O]; image.len()];
    out.par_chunks_mut(width)
        .zip(image.par_chunks(width))
        .for_each(|(sums, row)| {
            for k in 0..=2 * radius {
                // The pixels for which this tap lies inside of the row, and those on either side.
                let inside = radius.saturating_sub(k).min(width)
                    ..(width + radius).saturating_sub(k).min(width);
                for sum in &mut sums[..inside.start] {
                    tap(k, &row[0], sum);
                }
                if !inside.is_empty() {
                    let from = &row[inside.start + k - radius..];
                    for (value, sum) in from.iter().zip(&mut sums[inside.clone()]) {
                        tap(k, value, sum);
                    }
                }
                for sum in &mut sums[inside.end..] {
                    tap(k, &row[width - 1], sum);
                }
            }
        });
    out
}

/// Convolves along the columns; otherwise as [`along_x`].
pub(super) fn along_y<const I: usize, const O: usize>(
    image: &[[f32; I]],
    width: usize,
    radius: usize,
    tap: impl Fn(usize, &[f32; I], &mut [f32; O]) + Sync,
) -> Vec<[f32; O]> {
    let height = image.len() / width;
    let mut out = vec![[0.0; O]; image.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, sums)| {
        for k in 0..=2 * radius {
            let from = (y + k).saturating_sub(radius).min(height - 1);
            let row = &image[from * width..(from + 1) * width];
            for (value, sum) in row.iter().zip(sums.iter_mut()) {
                tap(k, value, sum);
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_repeat() {
        // A kernel that looks one to the right and one to the left (or down and up).
        let kernel = [100.0, 1.0, 10.0];
        let tap = |k: usize, value: &[f32; 1], sum: &mut [f32; 1]| sum[0] += kernel[k] * value[0];
        let line: Vec<[f32; 1]> = vec![[1.0], [2.0], [3.0]];
        let expected = vec![[121.0], [132.0], [233.0]];
        assert_eq!(along_x(&line, 3, 1, tap), expected);
        assert_eq!(along_y(&line, 1, 1, tap), expected);

        // A kernel wider than the image.
        let count = |_: usize, value: &[f32; 1], sum: &mut [f32; 1]| sum[0] += value[0];
        let expected = vec![[1.0 * 4.0 + 2.0 + 3.0 * 4.0]; 1];
        assert_eq!(along_x(&line, 3, 4, count)[1..2], expected);
        assert_eq!(along_y(&line, 1, 4, count)[1..2], expected);
        assert_eq!(along_x(&line[1..2], 1, 4, count), vec![[18.0]]);
    }
}
