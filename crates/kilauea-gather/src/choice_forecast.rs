//! What choosing lights by cells would bring, told by paths that did not.

use crate::choice_field::ChoiceField;
use crate::choice_record::ChoiceRecords;
use crate::picture::{MAX_RELATIVE_SQ, PathError, PictureEstimate};

/// Share of lights that are chosen as if nothing were known, whatever cells say.
pub const PLAIN_CHOICES: f32 = 0.2;
/// Share of the variance that no choice of lights takes away.
const LEAST_LEFT: f64 = 0.05;

/// What choices by cells promise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChoiceForecast {
    /// Share of choices that brought nothing.
    pub in_vain: f32,
    /// Variance of plain paths over that of paths that choose lights by cells.
    pub gain: f32,
}

/// Variance of `n_paths` plain paths, of which `plain` is known, over that which they would have had
/// with lights chosen by cells. None where there are no records.
///
/// The choice of a light changes the variance of a path by the second moment of what the light
/// brought, and by nothing else: what it brings in the mean stays the same. Each record is weighed by
/// its probability then and now, as in [`crate::forecast`], with cells of the other half of pixels.
///
/// That is of single paths. Samples of a pixel have stratified numbers, by which they share out first
/// choices evenly, so that pictures gain no more than this: how much they do, a trial tells.
pub fn forecast_choice(
    records: &ChoiceRecords,
    picture: &PictureEstimate,
    plain: PathError,
    n_paths: usize,
) -> Option<ChoiceForecast> {
    let (mut n_judged, mut n_in_vain, mut saved) = (0.0_f64, 0.0_f64, 0.0_f64);
    for is_odd in [false, true] {
        let half = |parity| records.filter(|r| ((r.pixel[0] ^ r.pixel[1]) & 1 == 1) == parity);
        let field = ChoiceField::fit(&half(!is_odd), picture)?;
        let judged = half(is_odd);
        for record in judged.iter().filter(|record| record.is_sound()) {
            n_judged += 1.0;
            if record.brought == 0.0 {
                n_in_vain += 1.0;
                continue;
            }
            let relative = record.brought * picture.per_luminance(record.pixel);
            let relative_sq = f64::from(MAX_RELATIVE_SQ.min(relative * relative));
            let cell = field.at(record.p, record.n);
            let by_cell = cell.ratio(judged.turns(record));
            let ratio = PLAIN_CHOICES + (1.0 - PLAIN_CHOICES) * by_cell;
            saved += relative_sq * f64::from(1.0 - 1.0 / ratio);
        }
    }
    let variance = f64::from(plain.relative_variance) * n_paths as f64;
    let left = (variance - saved).max(LEAST_LEFT * variance);
    let gain = if left > 0.0 { variance / left } else { 1.0 };
    (n_judged > 0.0).then_some(ChoiceForecast {
        in_vain: (n_in_vain / n_judged) as f32,
        gain: gain as f32,
    })
}
