use crate::functions::student_two_sided;

/// Mean and variance of independent values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Number of values.
    pub n: f64,
    /// Their mean.
    pub mean: f64,
    /// Unbiased estimate of their variance.
    pub variance: f64,
}

impl Moments {
    /// Of at least two values.
    pub fn of(values: &[f64]) -> Self {
        assert!(values.len() > 1, "{} values have no variance", values.len());
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        Self {
            n,
            mean,
            variance: squares / (n - 1.0),
        }
    }

    /// Standard deviation of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance / self.n).sqrt()
    }

    /// How often nearly normal values with the expectation `expected` have a mean that is as far
    /// off (Student 1908). A difference below `resolution` counts as none: what rounding does.
    pub fn p_value(&self, expected: f64, resolution: f64) -> f64 {
        let t = excess(self.mean - expected, resolution) / self.standard_error();
        student_or_exact(t, self.n - 1.0)
    }
}

/// How often two sets of nearly normal values with one expectation and any variances have means
/// that are as far apart (Welch 1947). A difference below `resolution` counts as none.
pub fn welch_p(a: &Moments, b: &Moments, resolution: f64) -> f64 {
    let [of_a, of_b] = [a, b].map(|m| m.variance / m.n);
    let t = excess(a.mean - b.mean, resolution) / (of_a + of_b).sqrt();
    let degrees = (of_a + of_b).powi(2) / (of_a.powi(2) / (a.n - 1.0) + of_b.powi(2) / (b.n - 1.0));
    student_or_exact(t, degrees)
}

fn excess(difference: f64, resolution: f64) -> f64 {
    (difference.abs() - resolution).max(0.0)
}

/// Values without variance are 0 / 0 where they agree, and infinitely far off where they do not.
fn student_or_exact(t: f64, degrees_of_freedom: f64) -> f64 {
    if t.is_nan() {
        1.0
    } else if t.is_infinite() {
        0.0
    } else {
        student_two_sided(t, degrees_of_freedom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_few_values() {
        let m = Moments::of(&[1.0, 2.0, 6.0]);
        assert_eq!((m.mean, m.variance), (3.0, 7.0));
        assert!((m.standard_error() - (7.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        // t = √(3 / 7) at two degrees.
        let t_sq = 3.0_f64 / 7.0;
        let expected = 1.0 - (t_sq / (2.0 + t_sq)).sqrt();
        assert!((m.p_value(2.0, 0.0) - expected).abs() < 1e-9);
    }

    #[test]
    fn welch_of_equal_sets_is_student() {
        // Equal sizes and variances: 2 n − 2 degrees.
        let [a, b] = [&[1.0, 3.0], &[2.0, 4.0]].map(|values| Moments::of(values));
        let t = 1.0 / 2.0_f64.sqrt();
        let expected = 1.0 - t / (2.0 + t * t).sqrt();
        assert!((welch_p(&a, &b, 0.0) - expected).abs() < 1e-9);
    }

    #[test]
    fn constants_agree_or_do_not() {
        let [a, b] = [1.0, 1.001].map(|v| Moments::of(&[v; 4]));
        assert_eq!(welch_p(&a, &a, 0.0), 1.0);
        assert_eq!(welch_p(&a, &b, 0.0), 0.0);
        assert_eq!(welch_p(&a, &b, 0.01), 1.0);
        assert_eq!(b.p_value(1.0, 1e-4), 0.0);
    }
}
