use kilauea_math::Vec2;

/// A choice among lights with probabilities in proportion to given weights.
#[derive(Clone, Debug)]
pub(super) struct LightChoice {
    /// Running sums of the weights, so many per light.
    cumulative: Vec<f64>,
}

/// What one number of [`Vec2`] leaves undecided: they have 24 bits.
const STEP: f64 = 1.0 / (1 << 24) as f64;

impl LightChoice {
    /// Weights that are no positive numbers count as zero.
    pub(super) fn new(weights: impl Iterator<Item = f32>) -> Self {
        let mut sum = 0.0;
        let cumulative = weights.map(|weight| {
            if weight > 0.0 && weight.is_finite() {
                sum += f64::from(weight);
            }
            sum
        });
        Self {
            cumulative: cumulative.collect(),
        }
    }

    /// Whether there is nothing to choose.
    pub(super) fn is_empty(&self) -> bool {
        self.total() <= 0.0
    }

    /// A light and its probability. The second number decides what the first leaves open.
    pub(super) fn sample(&self, u: Vec2) -> Option<(u32, f32)> {
        let total = self.total();
        if total <= 0.0 {
            return None;
        }
        let u = (f64::from(u.x) + f64::from(u.y) * STEP) * total;
        let idx = self.cumulative.partition_point(|&sum| sum <= u);
        let weight = self.weight(idx)?;
        Some((idx as u32, (weight / total) as f32))
    }

    /// Probability of a light.
    pub(super) fn probability(&self, light: u32) -> f32 {
        let weight = self.weight(light as usize).unwrap_or(0.0);
        if weight > 0.0 {
            (weight / self.total()) as f32
        } else {
            0.0
        }
    }

    fn total(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    fn weight(&self, idx: usize) -> Option<f64> {
        let before = idx.checked_sub(1).map_or(0.0, |i| self.cumulative[i]);
        self.cumulative.get(idx).map(|sum| sum - before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_are_chosen_by_weight_and_never_without() {
        let choice = LightChoice::new([0.0, 1.0, f32::NAN, 3.0, 0.0, -1.0].into_iter());
        let mut counts = [0_u32; 6];
        for i in 0..4000 {
            let u = Vec2::new(i as f32 / 4000.0, 0.5);
            let (light, probability) = choice.sample(u).unwrap();
            counts[light as usize] += 1;
            assert_eq!(probability, if light == 1 { 0.25 } else { 0.75 });
            assert_eq!(probability, choice.probability(light));
        }
        assert_eq!(counts, [0, 1000, 0, 3000, 0, 0]);
        assert_eq!(choice.probability(2), 0.0);
    }

    #[test]
    fn more_lights_than_a_number_has_values_are_all_found() {
        let n = 1 << 25;
        let choice = LightChoice::new((0..n).map(|_| 1.0));
        let odd = choice.sample(Vec2::new(0.25, 0.75)).unwrap();
        assert_eq!(odd.0, n / 4 + 1);
    }

    #[test]
    fn nothing_is_chosen_among_nothing() {
        assert!(
            LightChoice::new([].into_iter())
                .sample(Vec2::ZERO)
                .is_none()
        );
        assert!(
            LightChoice::new([0.0].into_iter())
                .sample(Vec2::ZERO)
                .is_none()
        );
    }
}
