//! By which of its lobes a surface scattered light: narrow ones, as a mirror does, or rough ones.

use kilauea_bsdf::SeenBsdf;
use kilauea_math::{Spectrum, Vec3};

/// Lobes of a lower roughness are narrow: specular for the classes of photons, as they see too few photons
/// of a map. A surface without any other keeps none.
pub const MIN_ROUGHNESS: f32 = 0.15;

/// Whether a surface scatters as a mirror does whatever lobe was drawn.
pub(crate) fn is_specular(is_delta: bool, bsdf: &SeenBsdf) -> bool {
    is_delta || !bsdf.has_rough_lobes(MIN_ROUGHNESS)
}

/// Tells the choice of lobes from all else that is decided at a vertex.
pub(crate) const LOBES_KEY: u32 = 0x1000_0000;

/// Lobes of one kind, of all that scattered light from one direction into another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DrawnLobes {
    pub(crate) are_narrow: bool,
    /// What of the light that diffuse lobes scatter, and of that which others do, is theirs, over the
    /// probability of having drawn them.
    pub(crate) shares: [Spectrum; 2],
}

impl DrawnLobes {
    pub(crate) const NARROW: Self = Self {
        are_narrow: true,
        shares: [Spectrum::ONE; 2],
    };
    pub(crate) const ROUGH: Self = Self {
        are_narrow: false,
        shares: [Spectrum::ONE; 2],
    };

    /// By which lobes of the first a path goes on to `wi`, which it drew from the second ones; `is_delta` if
    /// there was no other direction. Drawn by `u`, where there is a choice.
    pub(crate) fn draw_at(
        (wi, is_delta): (Vec3, bool),
        [bsdf, drawn_from]: [&SeenBsdf; 2],
        u: impl FnOnce() -> f32,
    ) -> Self {
        if is_specular(is_delta, bsdf) {
            return Self::NARROW;
        }
        if !bsdf.has_narrow_lobes(MIN_ROUGHNESS) {
            return Self::ROUGH;
        }
        let eval = drawn_from.eval(wi);
        let narrow = drawn_from.eval_narrow(wi, MIN_ROUGHNESS);
        Self::draw([eval.diffuse, eval.specular], narrow, u())
    }

    /// Draws narrow or rough lobes by `u`, uniform in [0, 1), where diffuse lobes and others scatter
    /// `scattered`, and `narrow` of the latter is of narrow ones.
    ///
    /// A path is of a class by the lobes that scattered it, so that it is of one class however it was found.
    /// Which lobe its direction was drawn from would not tell: several scatter into one direction.
    pub(crate) fn draw([diffuse, others]: [Spectrum; 2], narrow: Spectrum, u: f32) -> Self {
        let probability = narrow.luminance() / (diffuse + others).luminance();
        // What scatters nothing is rough.
        if probability.is_nan() || probability <= 0.0 {
            return Self::ROUGH;
        }
        let narrow_of_others = narrow / others.max(f32::MIN_POSITIVE);
        if u < probability {
            return Self {
                are_narrow: true,
                shares: [Spectrum::BLACK, narrow_of_others / probability],
            };
        }
        let rough_of_others = (Spectrum::ONE - narrow_of_others).max(0.0);
        let shares = [Spectrum::ONE, rough_of_others].map(|share| share / (1.0 - probability));
        Self {
            are_narrow: false,
            shares,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_kind_counts_what_it_scatters() {
        let diffuse = Spectrum::new(0.2, 0.7, 0.0);
        let others = Spectrum::new(0.8, 1.3, 0.0);
        let narrow = Spectrum::new(0.75, 0.5, 0.0);
        let n = 4000;
        let mut sums = [[Spectrum::BLACK; 2]; 2];
        for i in 0..n {
            let drawn = DrawnLobes::draw([diffuse, others], narrow, (i as f32 + 0.5) / n as f32);
            let [of_diffuse, of_others] = &mut sums[usize::from(drawn.are_narrow)];
            *of_diffuse += drawn.shares[0] * diffuse / n as f32;
            *of_others += drawn.shares[1] * others / n as f32;
        }
        let expected = [diffuse, others - narrow, Spectrum::BLACK, narrow];
        for (sum, expected) in sums.as_flattened().iter().zip(expected) {
            for c in 0..3 {
                assert!((sum[c] - expected[c]).abs() < 1e-3, "{sum:?} {expected:?}");
            }
        }
    }

    #[test]
    fn what_scatters_nothing_is_rough() {
        let black = Spectrum::BLACK;
        assert_eq!(DrawnLobes::draw([black; 2], black, 0.0), DrawnLobes::ROUGH);
        let white = Spectrum::ONE;
        let drawn = DrawnLobes::draw([black, white], white, 0.999);
        assert!(drawn.are_narrow && drawn.shares[1] == Spectrum::ONE);
    }
}
