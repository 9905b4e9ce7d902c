//! Motion keys: evenly spaced over the shutter, straight lines in between.

use kilauea_math::{DAffine3, DMat3, Vec3};

/// Most intervals that two motions are resampled to when one carries the other.
const MAX_INTERVALS: usize = 16;

/// The key before a time in [0, 1], and how far on to the next it is.
#[inline]
pub(crate) fn key_before(n_keys: usize, time: f32) -> (usize, f32) {
    let position = time.clamp(0.0, 1.0) * (n_keys - 1) as f32;
    let before = (position as usize).min(n_keys.saturating_sub(2));
    (before, position - before as f32)
}

/// The point between two keys, rounded as in the acceleration structure: the same bits.
#[inline]
pub(super) fn between(a: [f32; 3], b: [f32; 3], share: f32) -> Vec3 {
    let (a, b) = (Vec3::from_array(a), Vec3::from_array(b));
    a + share * (b - a)
}

/// A transform, perhaps moving.
#[derive(Clone, Debug)]
pub(super) enum TransformKeys {
    Still(DAffine3),
    /// At least two keys.
    Moving(Box<[DAffine3]>),
}

impl TransformKeys {
    /// The transform of one of many instances that move together.
    pub(super) fn of_instance(first: DAffine3, later: &[Vec<DAffine3>], idx: usize) -> Self {
        if later.is_empty() {
            return Self::Still(first);
        }
        let later = later.iter().map(|key| key[idx]);
        Self::Moving(std::iter::once(first).chain(later).collect())
    }

    /// This transform after another: `outer_from_inner * inner_from_innermost`.
    ///
    /// A product of two motions is no straight line between keys: it gets the keys of both.
    pub(super) fn after(&self, inner: &Self) -> Self {
        match (self, inner) {
            (Self::Still(outer), Self::Still(inner)) => Self::Still(*outer * *inner),
            (Self::Moving(outer), Self::Still(inner)) => {
                Self::Moving(outer.iter().map(|outer| *outer * *inner).collect())
            }
            (Self::Still(outer), Self::Moving(inner)) => {
                Self::Moving(inner.iter().map(|inner| *outer * *inner).collect())
            }
            (Self::Moving(a), Self::Moving(b)) => {
                let n = common_intervals(a.len() - 1, b.len() - 1);
                let at = |i: usize| {
                    let time = i as f64 / n as f64;
                    at_time(a, time) * at_time(b, time)
                };
                Self::Moving((0..=n).map(at).collect())
            }
        }
    }

    /// All keys.
    pub(super) fn keys(&self) -> &[DAffine3] {
        match self {
            Self::Still(transform) => std::slice::from_ref(transform),
            Self::Moving(keys) => keys,
        }
    }
}

/// The fewest intervals whose ends are the ends of both, or as many as there may be.
fn common_intervals(a: usize, b: usize) -> usize {
    (1..=MAX_INTERVALS)
        .find(|n| n % a == 0 && n % b == 0)
        .unwrap_or(MAX_INTERVALS.max(a).max(b))
}

fn at_time(keys: &[DAffine3], time: f64) -> DAffine3 {
    let position = time * (keys.len() - 1) as f64;
    let before = (position as usize).min(keys.len() - 2);
    let (share, a, b) = (position - before as f64, keys[before], keys[before + 1]);
    let mix = |a: DMat3, b: DMat3| a * (1.0 - share) + b * share;
    DAffine3 {
        matrix3: mix(a.matrix3, b.matrix3),
        translation: a.translation.lerp(b.translation, share),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::DVec3;

    fn moving(shifts: &[f64]) -> TransformKeys {
        let keys = shifts
            .iter()
            .map(|&x| DAffine3::from_translation(DVec3::X * x));
        TransformKeys::Moving(keys.collect())
    }

    fn shifts(keys: &TransformKeys) -> Vec<f64> {
        keys.keys().iter().map(|m| m.translation.x).collect()
    }

    #[test]
    fn times_lie_between_their_keys() {
        assert_eq!(key_before(3, 0.0), (0, 0.0));
        assert_eq!(key_before(3, 0.5), (1, 0.0));
        assert_eq!(key_before(3, 0.75), (1, 0.5));
        assert_eq!(key_before(3, 1.0), (1, 1.0));
    }

    #[test]
    fn motions_add_up_with_the_keys_of_both() {
        let still = TransformKeys::Still(DAffine3::from_translation(DVec3::X * 10.0));
        assert_eq!(shifts(&still.after(&moving(&[0.0, 1.0]))), [10.0, 11.0]);
        assert_eq!(shifts(&moving(&[0.0, 1.0]).after(&still)), [10.0, 11.0]);
        let both = moving(&[0.0, 6.0]).after(&moving(&[0.0, 0.0, 12.0]));
        assert_eq!(shifts(&both), [0.0, 3.0, 18.0]);
        let uneven = moving(&[0.0, 0.0, 6.0]).after(&moving(&[0.0, 3.0, 3.0, 3.0]));
        assert_eq!(shifts(&uneven), [0.0, 1.5, 3.0, 3.0, 5.0, 7.0, 9.0]);
    }
}
