//! Round cubic curves: the union of the balls along them.
//!
//! A ball enters the ray's line at depth g = z - √h. As u moves through a range where h ≥ 0 the
//! balls' chords move continuously, so together they cover one interval, which begins at the least
//! g; the ranges are few, since h has degree six. So the nearest hit is a minimum of g. Ranges are
//! clipped to where h can be positive and cut until g is certainly convex or monotonic there;
//! Newton's method does the rest. No choice of start can miss a bend or a tip.

use super::bernstein::{clip_nonnegative, derivative, evaluate, product, span};
use super::bezier::{Components, halves, part};
use super::ray_frame::{Place, RayFrame};

/// Cuts in a row, or looks at pieces in all, after which g is taken as unimodal: hits are then
/// still on a ball, if not on the outermost. Only rays along a curve of constant h come so far.
const MAX_CUTS: u32 = 14;
const MAX_VISITS: u32 = 200;

/// Where the ray enters the balls of a range of `curve` (x, y, z, radius in the ray's frame) or,
/// starting inside the curve, leaves it. `limit` is a depth beyond which hits do not matter.
pub(crate) fn intersect(
    curve: &Components<4>,
    range: [f64; 2],
    ray: &RayFrame,
    limit: f64,
) -> Option<Place> {
    let mut search = Search::new([ray.start(), limit]);
    search.visit(&part(curve, range), range, MAX_CUTS);
    let touches = search.best.is_some() || !is_before(curve, ray.start());
    let place = if touches && contains(curve, ray.start(), MAX_CUTS) {
        leave(curve, ray.start())
    } else {
        search.best
    };
    place.map(|[depth, u]| Place {
        t: ray.distance(depth),
        u,
        v: 0.0,
    })
}

/// h, of which the root is half the length of a ball's chord.
#[inline]
fn chords([x, y, _, r]: &Components<4>) -> [f64; 7] {
    let [xx, yy, rr]: [[f64; 7]; 3] = [product(x, x), product(y, y), product(r, r)];
    std::array::from_fn(|i| rr[i] - (xx[i] + yy[i]))
}

/// The least g between two depths.
struct Search {
    depths: [f64; 2],
    /// Depth and parameter.
    best: Option<[f64; 2]>,
    visits_left: u32,
}

impl Search {
    fn new(depths: [f64; 2]) -> Self {
        Self {
            depths,
            best: None,
            visits_left: MAX_VISITS,
        }
    }

    /// Looks at the `piece` of the curve over the parameters `range`.
    fn visit(&mut self, piece: &Components<4>, range: [f64; 2], cuts_left: u32) {
        let [x, y, z, r] = piece;
        let widest = span(r).1;
        let passes_by = |c: &[f64; 4]| span(c).0 > widest || span(c).1 < -widest;
        if passes_by(x) || passes_by(y) {
            return;
        }
        let h = chords(piece);
        let Some((from, to)) = clip_nonnegative(&h) else {
            return;
        };
        let (z_low, z_high) = span(z);
        let longest = span(&h).1.max(0.0).sqrt();
        let end = self.best.map_or(self.depths[1], |[depth, _]| depth);
        if z_high <= self.depths[0] || z_low - longest > end {
            return;
        }
        let place = |u: f64| range[0] + u * (range[1] - range[0]);
        self.visits_left = self.visits_left.saturating_sub(1);
        let cuts_left = if self.visits_left == 0 { 0 } else { cuts_left };
        if to - from < 0.7 && cuts_left > 0 {
            let clipped = [place(from), place(to)];
            return self.visit(&part(piece, [from, to]), clipped, cuts_left - 1);
        }
        if cuts_left == 0 || is_unimodal(z, &h) {
            if let Some([depth, u]) = descend(piece)
                && depth > self.depths[0]
                && depth <= end
                && self.best.is_none_or(|best| [depth, place(u)] < best)
            {
                self.best = Some([depth, place(u)]);
            }
            return;
        }
        let middle = place(0.5);
        let [low, high] = halves(piece);
        let mut sides = [(low, [range[0], middle]), (high, [middle, range[1]])];
        if z[0] > z[3] {
            sides.swap(0, 1);
        }
        for (half, range) in sides {
            self.visit(&half, range, cuts_left - 1);
        }
    }
}

/// Whether g = z - √h certainly has one minimum and no other turn.
///
/// It is convex where 4 h^(3/2) g'' = 4 h^(3/2) z'' + h'² - 2 h h'' is not negative, and only falls
/// or rises where 2 √h g' = 2 √h z' - h' is not zero.
fn is_unimodal(z: &[f64; 4], h: &[f64; 7]) -> bool {
    let (h_low, h_high) = span(h);
    let root_high = h_high.max(0.0).sqrt();
    let bends: [f64; 5] = std::array::from_fn(|i| 30.0 * (h[i + 2] - 2.0 * h[i + 1] + h[i]));
    let bend = span(&bends).1;
    let z_bend = 6.0 * f64::min(z[2] - 2.0 * z[1] + z[0], z[3] - 2.0 * z[2] + z[1]);
    if bend <= 0.0 && -bend >= 2.0 * root_high * -z_bend {
        return true;
    }
    let slopes: [f64; 6] = std::array::from_fn(|i| 6.0 * (h[i + 1] - h[i]));
    let (slope_low, slope_high) = span(&slopes);
    let flattest = f64::max(0.0, f64::max(slope_low, -slope_high));
    let z_part = 4.0 * root_high * h_high * f64::min(z_bend, 0.0);
    if z_part + flattest * flattest - 2.0 * h_high * bend.max(0.0) > 0.0 {
        return true;
    }
    let (z_low, z_high) = span(&derivative(z));
    let root_low = h_low.max(0.0).sqrt();
    let least = 2.0 * f64::min(root_low * z_low, root_high * z_low) - slope_high;
    let most = 2.0 * f64::max(root_low * z_high, root_high * z_high) - slope_low;
    least > 0.0 || most < 0.0
}

/// Depth and parameter of the least g of a piece where it is unimodal.
///
/// Newton's method between bounds. Where h is next to zero its steps are tiny far from the minimum
/// too, so only bounds that close in end the search: a tiny step becomes one just past its aim,
/// and bounds that do not close in are halved.
fn descend(piece: &Components<4>) -> Option<[f64; 2]> {
    const CLOSE: f64 = 1e-10;
    let (at_0, at_1) = (Turn::at(piece, 0.0), Turn::at(piece, 1.0));
    if at_0.slope() >= 0.0 {
        return at_0.depth().map(|depth| [depth, 0.0]);
    }
    if at_1.slope() <= 0.0 {
        return at_1.depth().map(|depth| [depth, 1.0]);
    }
    let (mut low, mut high) = (0.0, 1.0);
    let mut width = 1.0;
    let mut least: Option<[f64; 2]> = None;
    let mut u = (at_0.h[1] / (at_0.h[1] - at_1.h[1])).clamp(0.0, 1.0);
    for iteration in 1..100 {
        let turn = Turn::at(piece, u);
        if let Some(depth) = turn.depth()
            && least.is_none_or(|[least, _]| depth < least)
        {
            least = Some([depth, u]);
        }
        let slope = turn.slope();
        if slope < 0.0 {
            low = u;
        } else {
            high = u;
        }
        if high - low < 2.0 * CLOSE {
            break;
        }
        let mut step = -slope / turn.slope_change();
        if step.abs() < 0.5 * CLOSE {
            step = -CLOSE.copysign(slope);
        }
        u += step;
        let must_halve = iteration % 4 == 0 && high - low > 0.25 * width;
        if !(low < u && u < high) || must_halve {
            u = 0.5 * (low + high);
        }
        if iteration % 4 == 0 {
            width = high - low;
        }
    }
    least
}

/// Depth and h with two derivatives each.
struct Turn {
    z: [f64; 3],
    h: [f64; 3],
}

impl Turn {
    fn at(piece: &Components<4>, u: f64) -> Self {
        let [x, y, z, r] = piece.map(|c| evaluate(&c, u));
        let square = |[c, d, e]: [f64; 3]| [c * c, 2.0 * c * d, 2.0 * (d * d + c * e)];
        let (xx, yy, rr) = (square(x), square(y), square(r));
        Self {
            z,
            h: std::array::from_fn(|i| rr[i] - (xx[i] + yy[i])),
        }
    }

    /// g, if the ball meets the line.
    fn depth(&self) -> Option<f64> {
        (self.h[0] >= 0.0).then(|| self.z[0] - self.h[0].sqrt())
    }

    /// g' times 2 √h; where no ball meets the line, downhill is where h grows.
    fn slope(&self) -> f64 {
        2.0 * self.z[1] * self.h[0].max(0.0).sqrt() - self.h[1]
    }

    fn slope_change(&self) -> f64 {
        if self.h[0] <= 0.0 {
            return -self.h[2];
        }
        let root = self.h[0].sqrt();
        2.0 * self.z[2] * root + self.z[1] * self.h[1] / root - self.h[2]
    }
}

/// Whether a point of the ray's line is certainly nearer than all balls.
fn is_before([_, _, z, r]: &Components<4>, depth: f64) -> bool {
    (0..4).all(|i| z[i] - r[i] > depth)
}

/// Whether the point of the ray's line at `depth` is in one of the balls.
fn contains(piece: &Components<4>, depth: f64, cuts_left: u32) -> bool {
    if is_before(piece, depth) {
        return false;
    }
    let behind = piece[2].map(|z| z - depth);
    let square: [f64; 7] = product(&behind, &behind);
    let h = chords(piece);
    let inside: [f64; 7] = std::array::from_fn(|i| h[i] - square[i]);
    if inside[0] >= 0.0 || inside[6] >= 0.0 {
        return true;
    }
    let Some((from, to)) = clip_nonnegative(&inside) else {
        return false;
    };
    cuts_left > 0
        && halves(&part(piece, [from, to]))
            .iter()
            .any(|half| contains(half, depth, cuts_left - 1))
}

/// Depth and parameter where a ray from within leaves the balls.
fn leave(curve: &Components<4>, start: f64) -> Option<[f64; 2]> {
    let mut ranges = Vec::with_capacity(4);
    add_chord_ranges(curve, [0.0, 1.0], &mut ranges);
    let anywhere = [f64::NEG_INFINITY, f64::INFINITY];
    let least = |curve: &Components<4>, range: [f64; 2]| {
        let mut search = Search::new(anywhere);
        search.visit(&part(curve, range), range, MAX_CUTS);
        search.best
    };
    let [x, y, z, r] = *curve;
    let mirrored = [x, y, z.map(|z| -z), r];
    let mut chords: Vec<[[f64; 2]; 2]> = ranges
        .into_iter()
        .filter_map(|range| {
            let [last, u] = least(&mirrored, range)?;
            Some([least(curve, range)?, [-last, u]])
        })
        .collect();
    chords.sort_by(|a, b| a[0][0].total_cmp(&b[0][0]));
    let mut exit = [start, 0.0];
    for [first, last] in chords {
        if first[0] <= exit[0] && last[0] > exit[0] {
            exit = last;
        }
    }
    (exit[0] > start).then_some(exit)
}

/// Appends the ranges of parameters whose balls meet the line, in order.
fn add_chord_ranges(piece: &Components<4>, range: [f64; 2], out: &mut Vec<[f64; 2]>) {
    const SMALLEST: f64 = 1e-10;
    let h = chords(piece);
    let (low, high) = span(&h);
    if high < 0.0 {
        return;
    }
    if low >= 0.0 || range[1] - range[0] < SMALLEST {
        match out.last_mut() {
            Some(last) if last[1] == range[0] => last[1] = range[1],
            _ => out.push(range),
        }
        return;
    }
    let middle = 0.5 * (range[0] + range[1]);
    let [first, second] = halves(piece);
    add_chord_ranges(&first, [range[0], middle], out);
    add_chord_ranges(&second, [middle, range[1]], out);
}

#[cfg(test)]
mod tests;
