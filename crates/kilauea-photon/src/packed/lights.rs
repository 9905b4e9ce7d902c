/// The lights from which the photons of a map are, so that a photon names its own in 15 bits.
///
/// Of more than 32,767 lights, those with the highest indices have no number.
#[derive(Clone, Debug)]
pub(crate) struct LightTable {
    /// Ascending.
    light_indices: Vec<u32>,
}

/// The number of lights without one.
const UNNUMBERED: u16 = (1 << 15) - 1;

impl LightTable {
    pub(crate) fn new(light_indices: impl Iterator<Item = u32>) -> Self {
        let distinct: std::collections::BTreeSet<u32> = light_indices.collect();
        Self {
            light_indices: distinct.into_iter().take(UNNUMBERED.into()).collect(),
        }
    }

    pub(crate) fn number_of(&self, light_idx: u32) -> u16 {
        let found = self.light_indices.binary_search(&light_idx);
        found.map_or(UNNUMBERED, |number| number as u16)
    }

    #[inline]
    pub(crate) fn light_idx(&self, number: u16) -> Option<u32> {
        self.light_indices.get(usize::from(number)).copied()
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.light_indices.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_keep_their_indices() {
        let table = LightTable::new([7, u32::MAX, 7, 0].into_iter());
        for light_idx in [0, 7, u32::MAX] {
            assert_eq!(table.light_idx(table.number_of(light_idx)), Some(light_idx));
        }
    }

    #[test]
    fn lights_beyond_the_table_are_not_mistaken_for_others() {
        let table = LightTable::new(0..40_000);
        assert_eq!(table.light_idx(table.number_of(32_766)), Some(32_766));
        for light_idx in [32_767, 39_999] {
            assert_eq!(table.light_idx(table.number_of(light_idx)), None);
        }
    }
}
