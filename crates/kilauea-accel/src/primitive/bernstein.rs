//! Polynomials on [0, 1] by their Bernstein coefficients, which bound them from both sides.

/// The product of polynomials of degrees A - 1 and B - 1; N = A + B - 1.
#[inline]
pub(crate) fn product<const A: usize, const B: usize, const N: usize>(
    a: &[f64; A],
    b: &[f64; B],
) -> [f64; N] {
    const { assert!(N + 1 == A + B) };
    let mut out = [0.0; N];
    for i in 0..A {
        for j in 0..B {
            out[i + j] += a[i] * b[j] * (binomial(A - 1, i) * binomial(B - 1, j));
        }
    }
    for (k, coefficient) in out.iter_mut().enumerate() {
        *coefficient /= binomial(N - 1, k);
    }
    out
}

#[inline]
const fn binomial(n: usize, k: usize) -> f64 {
    let mut value = 1.0;
    let mut i = 0;
    while i < k {
        value = value * (n - i) as f64 / (i + 1) as f64;
        i += 1;
    }
    value
}

/// The derivative of a cubic.
#[inline]
pub(crate) fn derivative(c: &[f64; 4]) -> [f64; 3] {
    [
        3.0 * (c[1] - c[0]),
        3.0 * (c[2] - c[1]),
        3.0 * (c[3] - c[2]),
    ]
}

/// Value, first and second derivative of a cubic.
#[inline]
pub(crate) fn evaluate(c: &[f64; 4], u: f64) -> [f64; 3] {
    let [a, b, d] = [0, 1, 2].map(|i| lerp(c[i], c[i + 1], u));
    let (ab, bd) = (lerp(a, b, u), lerp(b, d, u));
    [lerp(ab, bd, u), 3.0 * (bd - ab), 6.0 * ((d - b) - (b - a))]
}

/// The polynomial of degree N - 1 at `u` (de Casteljau).
#[inline]
pub(crate) fn value<const N: usize>(mut c: [f64; N], u: f64) -> f64 {
    for n in (1..N).rev() {
        for i in 0..n {
            c[i] = lerp(c[i], c[i + 1], u);
        }
    }
    c[0]
}

/// The cubic over `[from, to]` as one over [0, 1] (its blossom at the ends).
#[inline]
pub(crate) fn subrange(c: &[f64; 4], from: f64, to: f64) -> [f64; 4] {
    let at_from = [0, 1, 2].map(|i| lerp(c[i], c[i + 1], from));
    let at_to = [0, 1, 2].map(|i| lerp(c[i], c[i + 1], to));
    let blossom = |steps: &[f64; 3], v: f64, w: f64| {
        lerp(lerp(steps[0], steps[1], v), lerp(steps[1], steps[2], v), w)
    };
    [
        blossom(&at_from, from, from),
        blossom(&at_from, from, to),
        blossom(&at_to, to, from),
        blossom(&at_to, to, to),
    ]
}

/// Both halves of a cubic.
#[inline]
pub(crate) fn halve(c: &[f64; 4]) -> ([f64; 4], [f64; 4]) {
    let [a, b, d] = [0, 1, 2].map(|i| 0.5 * (c[i] + c[i + 1]));
    let (ab, bd) = (0.5 * (a + b), 0.5 * (b + d));
    let middle = 0.5 * (ab + bd);
    ([c[0], a, ab, middle], [middle, bd, d, c[3]])
}

/// Lowest and highest coefficient.
#[inline]
pub(crate) fn span<const N: usize>(c: &[f64; N]) -> (f64, f64) {
    let low = c.iter().copied().fold(f64::INFINITY, f64::min);
    let high = c.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low, high)
}

/// A range outside which the polynomial is negative; `None` where that is everywhere.
///
/// From either end, the steepest line to another point of the control polygon bounds the
/// polynomial (Bézier clipping, Sederberg & Nishita 1990).
#[inline]
pub(crate) fn clip_nonnegative<const N: usize>(c: &[f64; N]) -> Option<(f64, f64)> {
    // Rounding must not take away the end of a range.
    const SLACK: f64 = 1e-9;
    if c.iter().all(|&c| c < 0.0) {
        return None;
    }
    let crossing = |at: &dyn Fn(usize) -> f64| {
        let first = at(0);
        if first >= 0.0 {
            return 0.0;
        }
        let rise = (1..N).fold(0.0, |rise, i| f64::max(rise, (at(i) - first) / i as f64));
        -first / (rise * (N - 1) as f64)
    };
    let from = crossing(&|i| c[i]);
    let to = 1.0 - crossing(&|i| c[N - 1 - i]);
    let (from, to) = ((from - SLACK).max(0.0), (to + SLACK).min(1.0));
    (from <= to).then_some((from, to))
}

#[inline]
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + t * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [f64; 4] = [0.3, -1.0, 2.0, 0.7];
    const B: [f64; 4] = [-0.2, 0.4, 1.5, -3.0];

    #[test]
    fn products_derivatives_and_subranges_agree_with_values() {
        let ab: [f64; 7] = product(&A, &B);
        let part = subrange(&A, 0.2, 0.7);
        let (left, right) = halve(&A);
        for i in 0..=10 {
            let u = f64::from(i) / 10.0;
            let [a, slope, curvature] = evaluate(&A, u);
            assert!((value(ab, u) - a * value(B, u)).abs() < 1e-14);
            assert!((value(derivative(&A), u) - slope).abs() < 1e-14);
            let step = 1e-4;
            let around = value(A, u - step) + value(A, u + step) - 2.0 * a;
            assert!((around / (step * step) - curvature).abs() < 1e-6);
            assert!((value(part, u) - value(A, 0.2 + 0.5 * u)).abs() < 1e-14);
            assert!((value(left, u) - value(A, 0.5 * u)).abs() < 1e-14);
            assert!((value(right, u) - value(A, 0.5 + 0.5 * u)).abs() < 1e-14);
        }
    }

    #[test]
    fn clipping_keeps_what_is_not_negative() {
        let c = [-1.0, -0.4, 0.9, 0.2, -0.3, -2.0, -1.0];
        let (from, to) = clip_nonnegative(&c).expect("it is positive somewhere");
        assert!(0.1 < from && to < 0.9);
        for i in 0..=1000 {
            let u = f64::from(i) / 1000.0;
            assert!(value(c, u) < 0.0 || (from..=to).contains(&u), "{u}");
        }
        assert_eq!(clip_nonnegative(&[-1.0, -0.1, -2.0]), None);
    }
}
