use crate::ray::Hit;

/// Which hits count.
pub(crate) trait Keep {
    /// Whether all do, so that nobody needs to be asked.
    const ALL: bool;
    fn keep(&mut self, hit: &Hit) -> bool;
}

/// Every hit counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeepAll;

impl Keep for KeepAll {
    const ALL: bool = true;

    #[inline(always)]
    fn keep(&mut self, _: &Hit) -> bool {
        true
    }
}

impl<F: FnMut(&Hit) -> bool> Keep for F {
    const ALL: bool = false;

    #[inline(always)]
    fn keep(&mut self, hit: &Hit) -> bool {
        self(hit)
    }
}
