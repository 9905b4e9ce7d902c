//! Flat cubic curves: the points c(u) + s b(u) with |s| up to the radius, where b goes across.
//!
//! A ribbon that faces the ray has b across the ray and the curve; the ray meets it where it passes
//! nearest to the curve as seen along the ray (as PBR 4ed., section 6.7, has it, without its
//! chords). An oriented one has b across the curve and its normal. Either way the ray's line meets
//! the endless surface where c × b has no component along the ray: a root of a polynomial in u,
//! isolated by cutting the curve until its coefficients rise or fall in order.

use super::bernstein::{clip_nonnegative, derivative, evaluate, product, span};
use super::bezier::{Components, halves, part};
use super::ray_frame::{Place, RayFrame};

/// Cuts after which a root is taken as the only one of its range.
const MAX_CUTS: u32 = 24;
/// How far ranges of the same curve overlap, so that rounding opens no gap between them.
const OVERLAP: f64 = 1e-7;
/// How far the line may be to the side of b, in radii, where a root is found. At a root it is on b
/// but for rounding, unless the curve stops there to turn back and b jumps.
const ROOT_SLACK: f64 = 1e-6;
/// The same at the flat ends of a ribbon, which so reaches past them: joints of smooth curves agree
/// only as far as their control points are rounded.
const END_SLACK: f64 = 1e-4;

/// What a ribbon's direction across is; C components of a curve, N coefficients.
trait Across<const C: usize, const N: usize> {
    /// The component of c × b along the ray.
    fn miss(piece: &Components<C>) -> [f64; N];
    /// b of any length, from values and derivatives of the components.
    fn across(at: &[[f64; 3]; C]) -> [f64; 3];
}

/// Across the ray and the curve.
struct Facing;

impl Across<4, 6> for Facing {
    #[inline]
    fn miss([x, y, ..]: &Components<4>) -> [f64; 6] {
        let along_x: [f64; 6] = product(x, &derivative(x));
        let along_y: [f64; 6] = product(y, &derivative(y));
        std::array::from_fn(|i| along_x[i] + along_y[i])
    }

    #[inline]
    fn across([[_, dx, _], [_, dy, _], ..]: &[[f64; 3]; 4]) -> [f64; 3] {
        [*dy, -dx, 0.0]
    }
}

/// Across a normal given along the curve (components 4 to 6) and the curve.
struct Oriented;

impl Across<7, 9> for Oriented {
    #[inline]
    fn miss([x, y, z, _, nx, ny, nz]: &Components<7>) -> [f64; 9] {
        let [dx, dy, dz] = [derivative(x), derivative(y), derivative(z)];
        let difference = |[a, b]: [&[f64; 4]; 2], [da, db]: [&[f64; 3]; 2]| -> [f64; 6] {
            let (first, second): ([f64; 6], [f64; 6]) = (product(a, da), product(b, db));
            std::array::from_fn(|i| first[i] - second[i])
        };
        let across_x = difference([ny, nz], [&dz, &dy]);
        let across_y = difference([nz, nx], [&dx, &dz]);
        let first: [f64; 9] = product(x, &across_y);
        let second: [f64; 9] = product(y, &across_x);
        std::array::from_fn(|i| first[i] - second[i])
    }

    #[inline]
    fn across([x, y, z, _, nx, ny, nz]: &[[f64; 3]; 7]) -> [f64; 3] {
        [
            ny[0] * z[1] - nz[0] * y[1],
            nz[0] * x[1] - nx[0] * z[1],
            nx[0] * y[1] - ny[0] * x[1],
        ]
    }
}

/// Where the ray first meets a range of the ribbon along `curve` (x, y, z, radius in the ray's
/// frame) that faces it. `limit` is a depth beyond which hits do not matter.
pub(crate) fn intersect_facing(
    curve: &Components<4>,
    range: [f64; 2],
    ray: &RayFrame,
    limit: f64,
) -> Option<Place> {
    Search::<Facing, 4, 6>::run(curve, range, ray, limit)
}

/// Where the ray first meets a range of the ribbon with normals, components 4 to 6 of `curve`.
pub(crate) fn intersect_oriented(
    curve: &Components<7>,
    range: [f64; 2],
    ray: &RayFrame,
    limit: f64,
) -> Option<Place> {
    Search::<Oriented, 7, 9>::run(curve, range, ray, limit)
}

/// The nearest hit between two depths.
struct Search<'a, A, const C: usize, const N: usize> {
    curve: &'a Components<C>,
    depths: [f64; 2],
    /// Depth, parameter, place across.
    best: Option<[f64; 3]>,
    across: std::marker::PhantomData<A>,
}

impl<'a, A: Across<C, N>, const C: usize, const N: usize> Search<'a, A, C, N> {
    fn run(curve: &'a Components<C>, range: [f64; 2], ray: &RayFrame, limit: f64) -> Option<Place> {
        let mut search = Self {
            curve,
            depths: [ray.start(), limit],
            best: None,
            across: std::marker::PhantomData,
        };
        let range = [(range[0] - OVERLAP).max(0.0), (range[1] + OVERLAP).min(1.0)];
        search.visit(&part(curve, range), range, MAX_CUTS);
        for end in range.into_iter().filter(|&u| u == 0.0 || u == 1.0) {
            search.offer(end, END_SLACK);
        }
        search.best.map(|[depth, u, v]| Place {
            t: ray.distance(depth),
            u,
            v,
        })
    }

    fn visit(&mut self, piece: &Components<C>, range: [f64; 2], cuts_left: u32) {
        let [x, y, z, r] = [&piece[0], &piece[1], &piece[2], &piece[3]];
        let widest = span(r).1;
        let passes_by = |c: &[f64; 4]| span(c).0 > widest || span(c).1 < -widest;
        if passes_by(x) || passes_by(y) {
            return;
        }
        let (z_low, z_high) = span(z);
        let end = self.best.map_or(self.depths[1], |[depth, ..]| depth);
        if z_high + widest <= self.depths[0] || z_low - widest > end {
            return;
        }
        let [xx, yy, rr]: [[f64; 7]; 3] = [product(x, x), product(y, y), product(r, r)];
        let h: [f64; 7] = std::array::from_fn(|i| rr[i] - (xx[i] + yy[i]));
        let Some((from, to)) = clip_nonnegative(&h) else {
            return;
        };
        let place = |u: f64| range[0] + u * (range[1] - range[0]);
        if to - from < 0.7 && cuts_left > 0 {
            let clipped = [place(from), place(to)];
            return self.visit(&part(piece, [from, to]), clipped, cuts_left - 1);
        }
        let miss = A::miss(piece);
        let (low, high) = span(&miss);
        let rounding = 1e-12 * f64::max(high, -low);
        if low > rounding || high < -rounding {
            return;
        }
        let rises = miss.windows(2).all(|c| c[0] <= c[1]);
        let falls = miss.windows(2).all(|c| c[0] >= c[1]);
        if rises || falls || cuts_left == 0 {
            let u = place(root(&miss));
            return self.offer(u, ROOT_SLACK);
        }
        let middle = place(0.5);
        let [first, second] = halves(piece);
        self.visit(&first, [range[0], middle], cuts_left - 1);
        self.visit(&second, [middle, range[1]], cuts_left - 1);
    }

    /// Takes the hit at parameter `u` if it is nearer than others and on the ribbon, but for `slack`
    /// radii along the curve.
    fn offer(&mut self, u: f64, slack: f64) {
        let at = self.curve.map(|c| evaluate(&c, u));
        let (x, y, z, r) = (at[0][0], at[1][0], at[2][0], at[3][0]);
        let [bx, by, bz] = A::across(&at);
        let seen_squared = bx * bx + by * by;
        if seen_squared == 0.0 {
            return;
        }
        let side = (x * by - y * bx).abs();
        if side > slack * r * seen_squared.sqrt() {
            return;
        }
        let steps = -(x * bx + y * by) / seen_squared;
        let offset = steps * (seen_squared + bz * bz).sqrt();
        let depth = z + steps * bz;
        let in_range = self.depths[0] < depth && depth <= self.depths[1];
        if offset.abs() > r || !in_range {
            return;
        }
        let across = if r > 0.0 { 0.5 + 0.5 * offset / r } else { 0.5 };
        if self
            .best
            .is_none_or(|[best, best_u, _]| (depth, u) < (best, best_u))
        {
            self.best = Some([depth, u, across]);
        }
    }
}

/// The root in [0, 1] of a monotonic polynomial, or the end that is nearest to zero.
fn root<const N: usize>(c: &[f64; N]) -> f64 {
    const CLOSE: f64 = 1e-12;
    let (first, last) = (c[0], c[N - 1]);
    if (first > 0.0) == (last > 0.0) {
        return if first.abs() <= last.abs() { 0.0 } else { 1.0 };
    }
    let (mut below, mut above) = if first <= 0.0 { (0.0, 1.0) } else { (1.0, 0.0) };
    let mut u = first / (first - last);
    for _ in 0..100 {
        let (value, slope) = value_and_slope(c, u);
        if value <= 0.0 {
            below = u;
        } else {
            above = u;
        }
        let mut next = u - value / slope;
        if !(f64::min(below, above) < next && next < f64::max(below, above)) {
            next = 0.5 * (below + above);
        }
        let step = (next - u).abs();
        u = next;
        if step < CLOSE {
            break;
        }
    }
    u
}

fn value_and_slope<const N: usize>(c: &[f64; N], u: f64) -> (f64, f64) {
    let mut c = *c;
    for n in (2..N).rev() {
        for i in 0..n {
            c[i] += u * (c[i + 1] - c[i]);
        }
    }
    let step = c[1] - c[0];
    (c[0] + u * step, (N - 1) as f64 * step)
}

#[cfg(test)]
mod tests;
