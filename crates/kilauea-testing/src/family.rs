/// Chance that a family of sound cases is rejected.
const SIGNIFICANCE: f64 = 1e-3;

/// p-values of independent cases that must all be sound.
///
/// Each is held against the level at which the family as a whole is rejected with a probability of
/// 0.001 (Šidák 1967).
#[derive(Clone, Debug)]
pub struct Family {
    name: String,
    cases: Vec<(String, f64)>,
}

impl Family {
    /// A family without cases.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            cases: Vec::new(),
        }
    }

    /// Adds a case. A p-value that is no number counts as zero.
    pub fn add(&mut self, case: impl Into<String>, p_value: f64) {
        let p_value = if p_value.is_nan() { 0.0 } else { p_value };
        self.cases.push((case.into(), p_value));
    }

    /// Number of cases.
    pub fn len(&self) -> usize {
        self.cases.len()
    }

    /// Whether there is no case.
    pub fn is_empty(&self) -> bool {
        self.cases.is_empty()
    }

    /// The p-value below which a case is rejected.
    pub fn level(&self) -> f64 {
        // 1 − (1 − α)^(1/n) without cancellation.
        -((-SIGNIFICANCE).ln_1p() / self.len().max(1) as f64).exp_m1()
    }

    /// Cases that are not sound, with their p-values.
    pub fn rejected(&self) -> impl Iterator<Item = &(String, f64)> {
        let level = self.level();
        self.cases.iter().filter(move |(_, p)| *p < level)
    }

    /// Panics if there is no case, or any that is not sound.
    #[track_caller]
    pub fn check(&self) {
        assert!(!self.is_empty(), "{}: no case", self.name);
        let rejected: Vec<String> = self
            .rejected()
            .map(|(case, p)| format!("\n  {case}: p = {p:.2e}"))
            .collect();
        assert!(
            rejected.is_empty(),
            "{}: {} of {} cases below p = {:.2e}:{}",
            self.name,
            rejected.len(),
            self.len(),
            self.level(),
            rejected.concat()
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(p_values: &[f64]) -> Family {
        let mut family = Family::new("test");
        for &p in p_values {
            family.add("case", p);
        }
        family
    }

    #[test]
    fn the_level_falls_with_the_number_of_cases() {
        assert!((family(&[0.5]).level() - 1e-3).abs() < 1e-12);
        let level = family(&[0.5; 100]).level();
        assert!(((1.0 - level).powi(100) - 0.999).abs() < 1e-12, "{level}");
    }

    #[test]
    fn one_bad_case_is_enough() {
        family(&[0.5; 100]).check();
        let mut all = vec![0.5; 99];
        all.push(9e-6);
        assert_eq!(family(&all).rejected().count(), 1);
        assert_eq!(family(&[f64::NAN]).rejected().count(), 1);
        // Bad alone, but what the worst of a hundred may well be.
        all[99] = 9e-4;
        assert_eq!(family(&all).rejected().count(), 0);
    }

    #[test]
    #[should_panic(expected = "no case")]
    fn nothing_tested_is_nothing_proved() {
        family(&[]).check();
    }
}
