//! What drawing directions from cells would bring, told by paths that did not.

use crate::field::GatherField;
use crate::picture::{MAX_RELATIVE_SQ, PictureEstimate};
use crate::record::GatherRecord;

/// The second moment of what vertices of plain paths brought to their pixels, over that which it
/// would have had with the share `share` of directions drawn from cells: each record is weighed by
/// its density then and now. Above one, cells know where light comes from. None where records tell
/// nothing.
///
/// One half of the pixels is judged by cells of the other and the other way round, so that noise is
/// not taken for knowledge. What guided vertices behind a vertex would bring is left out.
pub fn forecast(records: &[GatherRecord], picture: &PictureEstimate, share: f32) -> Option<f32> {
    let is_even = |record: &GatherRecord| (record.pixel[0] ^ record.pixel[1]) & 1 == 0;
    let (even, odd): (Vec<GatherRecord>, Vec<GatherRecord>) =
        records.iter().copied().partition(is_even);
    let (mut plain, mut guided) = (0.0_f64, 0.0_f64);
    for (judged, others) in [(&even, &odd), (&odd, &even)] {
        let field = GatherField::fit(others)?;
        for record in judged.iter().filter(|record| record.is_sound()) {
            let relative = record.brought * picture.per_luminance(record.pixel);
            let relative_sq = f64::from(MAX_RELATIVE_SQ.min(relative * relative));
            let arrival = &record.arrival;
            let pdf = field
                .directions(record.p, record.n)
                .map_or(arrival.pdf, |tree| {
                    (1.0 - share) * arrival.pdf + share * tree.pdf(arrival.wi)
                });
            plain += relative_sq;
            guided += relative_sq * f64::from(arrival.pdf / pdf);
        }
    }
    (guided > 0.0).then_some((plain / guided) as f32)
}
