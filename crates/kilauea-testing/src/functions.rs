//! Tails of the normal, chi² and Student distributions, by their incomplete gamma and beta
//! functions (Press et al. 2007, "Numerical Recipes", 6.1 to 6.4).

use std::f64::consts::PI;

/// Terms after which a series or continued fraction is taken as converged.
const MAX_TERMS: u32 = 100_000;
const PRECISION: f64 = 1e-14;

/// Probability that a chi² variable exceeds `chi2`.
pub fn chi2_survival(chi2: f64, degrees_of_freedom: f64) -> f64 {
    upper_gamma(0.5 * degrees_of_freedom, 0.5 * chi2.max(0.0))
}

/// Probability that a standard normal variable is further from zero than `z`.
pub fn normal_two_sided(z: f64) -> f64 {
    upper_gamma(0.5, 0.5 * z * z)
}

/// Probability that Student's variable is further from zero than `t`.
pub fn student_two_sided(t: f64, degrees_of_freedom: f64) -> f64 {
    let x = degrees_of_freedom / (degrees_of_freedom + t * t);
    regularized_beta(x, 0.5 * degrees_of_freedom, 0.5)
}

/// ln Γ(x) for x > 0: Stirling's series, after the recurrence has made x large.
fn ln_gamma(x: f64) -> f64 {
    if x < 10.0 {
        return ln_gamma(x + 1.0) - x.ln();
    }
    let inverse_sq = 1.0 / (x * x);
    let series = [-1.0 / 1680.0, 1.0 / 1260.0, -1.0 / 360.0, 1.0 / 12.0]
        .into_iter()
        .fold(0.0, |sum, term| sum * inverse_sq + term);
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + series / x
}

/// Q(a, x), the regularised upper incomplete gamma function.
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    if !x.is_finite() {
        return 0.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        return 1.0 - scale * lower_series(a, x);
    }
    let term = |n: u32| {
        let n = f64::from(n);
        (-n * (n - a), x + 2.0 * n + 1.0 - a)
    };
    scale / continued_fraction(x + 1.0 - a, term)
}

/// Σ x^n / (a (a + 1) … (a + n)).
fn lower_series(a: f64, x: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    for n in 1..MAX_TERMS {
        term *= x / (a + f64::from(n));
        sum += term;
        if term < sum * PRECISION {
            break;
        }
    }
    sum
}

/// I_x(a, b), the regularised incomplete beta function.
fn regularized_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    // The fraction converges fast below the mean.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - regularized_beta(1.0 - x, b, a);
    }
    let ln_beta = ln_gamma(a) + ln_gamma(b) - ln_gamma(a + b);
    let scale = (a * x.ln() + b * (1.0 - x).ln() - ln_beta).exp() / a;
    let term = |n: u32| {
        let m = f64::from(n / 2);
        let (numerator, denominator) = if n.is_multiple_of(2) {
            (m * (b - m) * x, (a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            let factors = (a + m) * (a + b + m) * x;
            (-factors, (a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        (numerator / denominator, 1.0)
    };
    scale / continued_fraction(1.0, term)
}

/// b₀ + a₁ / (b₁ + a₂ / (b₂ + …)), where `term(n)` is (aₙ, bₙ), by the modified method of Lentz.
fn continued_fraction(b0: f64, term: impl Fn(u32) -> (f64, f64)) -> f64 {
    const TINY: f64 = 1e-300;
    let away_from_zero = |x: f64| if x.abs() < TINY { TINY } else { x };
    let mut value = away_from_zero(b0);
    let (mut c, mut d) = (value, 0.0);
    for n in 1..MAX_TERMS {
        let (a, b) = term(n);
        d = 1.0 / away_from_zero(b + a * d);
        c = away_from_zero(b + a / c);
        value *= c * d;
        if (c * d - 1.0).abs() < PRECISION {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(found: f64, expected: f64) {
        let error = (found / expected - 1.0).abs();
        assert!(error < 1e-9, "{found} instead of {expected}");
    }

    #[test]
    fn gammas_of_whole_and_half_numbers() {
        check(ln_gamma(0.5), PI.sqrt().ln());
        check(ln_gamma(7.0), 720.0_f64.ln());
        let product: f64 = (1..=100).map(|i| f64::from(i).ln()).sum();
        check(ln_gamma(101.0), product);
    }

    #[test]
    fn chi2_with_even_degrees_is_a_poisson_sum() {
        // Q(k/2, x/2) = exp(-x/2) Σ_{i < k/2} (x/2)^i / i!
        for (x, half_k) in [(1.0, 1), (3.0, 2), (20.0, 5), (60.0, 40), (500.0, 200)] {
            let mean: f64 = 0.5 * x;
            let mut term = (-mean).exp();
            let mut sum = 0.0;
            for i in 0..half_k {
                sum += term;
                term *= mean / f64::from(i + 1);
            }
            check(chi2_survival(x, 2.0 * f64::from(half_k)), sum);
        }
    }

    #[test]
    fn normal_tails() {
        check(normal_two_sided(0.0), 1.0);
        // From Mills' ratio, by the asymptotic series at a large z.
        let z = 12.0_f64;
        let density = (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
        let inverse_sq = 1.0 / (z * z);
        let series = [-945.0, 105.0, -15.0, 3.0, -1.0, 1.0]
            .into_iter()
            .fold(0.0, |sum, term| sum * inverse_sq + term);
        let error = normal_two_sided(z) / (2.0 * density / z * series) - 1.0;
        assert!(error.abs() < 1e-8, "{error}");
    }

    #[test]
    fn student_with_one_and_two_degrees_has_closed_forms() {
        for t in [0.1_f64, 1.0, 3.0, 40.0] {
            check(student_two_sided(t, 1.0), 1.0 - 2.0 / PI * t.atan());
            check(student_two_sided(t, 2.0), 1.0 - t / (2.0 + t * t).sqrt());
        }
        // Of many degrees it is nearly normal.
        let far = student_two_sided(2.0, 1e7) / normal_two_sided(2.0) - 1.0;
        assert!(far.abs() < 1e-5, "{far}");
    }
}
