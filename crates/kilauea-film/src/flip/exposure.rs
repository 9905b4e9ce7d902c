//! The exposures at which HDR-FLIP looks at two images (Andersson et al. 2021, section 4).

/// The ACES filmic fit of Narkowicz 2016 with its pre-exposure of 0.6 folded in:
/// (a x² + b x) / (c x² + d x + e).
const ACES: [f32; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];
/// The largest and the median luminance of the reference are brought to this display value.
const TARGET: f32 = 0.85;

/// Exposures in stops, from where the brightest pixel of the reference is not yet clipped to
/// where its median pixel is as bright; about one stop apart.
pub(super) fn exposures(reference: &[[f32; 3]]) -> Vec<f32> {
    let mut luminances: Vec<f32> = reference
        .iter()
        .map(|rgb| 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2])
        .collect();
    luminances.sort_unstable_by(f32::total_cmp);
    let brightest = luminances.last().copied().unwrap_or(0.0);
    if brightest <= 0.0 {
        return vec![0.0];
    }
    let mid = luminances.len() / 2;
    let median = 0.5 * (luminances[mid] + luminances[(luminances.len() - 1) / 2]);

    let target = scene_value(TARGET);
    let start = (target / brightest).log2();
    let stop = (target / median.max(f32::EPSILON)).log2();
    let n = (stop - start).ceil().max(2.0);
    (0..n as usize)
        .map(|i| start + i as f32 * (stop - start) / (n - 1.0))
        .collect()
}

/// Display value, 0 to 1, of scene-linear light.
pub(super) fn tone_map(rgb: [f32; 3], exposure: f32) -> [f32; 3] {
    let [a, b, c, d, e] = ACES;
    let scale = exposure.exp2();
    rgb.map(|value| {
        // Far above this the curve is flat and squares would overflow.
        let x = (value * scale).clamp(0.0, 1e6);
        ((a * x + b) * x / ((c * x + d) * x + e)).clamp(0.0, 1.0)
    })
}

/// The light that [`tone_map`] shows as `display`: the positive root of the quadratic.
fn scene_value(display: f32) -> f32 {
    let [a, b, c, d, e] = ACES;
    let (p, q) = (
        (b - display * d) / (a - display * c),
        -display * e / (a - display * c),
    );
    -0.5 * p + (0.25 * p * p - q).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_and_its_inverse_agree() {
        let x = scene_value(TARGET);
        let [y, zero, one] = tone_map([x, -1.0, f32::MAX], 0.0);
        assert!((y - TARGET).abs() < 1e-6, "{y}");
        assert_eq!([zero, one], [0.0, 1.0]);
        assert_eq!(tone_map([0.5 * x; 3], 1.0)[0], y);
    }

    #[test]
    fn exposures_span_from_the_brightest_to_the_median() {
        let mut image = vec![[1.0; 3]; 9];
        image[3] = [32.0; 3];
        let all = exposures(&image);
        assert_eq!(all.len(), 5);
        assert!((all[4] - all[0] - 5.0).abs() < 1e-5, "{all:?}");
        assert!((tone_map([32.0; 3], all[0])[0] - TARGET).abs() < 1e-5);
        assert!((tone_map([1.0; 3], all[4])[0] - TARGET).abs() < 1e-5);
    }
}
