use super::{Guide, Unguided};
use crate::light::{ByCells, CellWalk, LightChooser, Receiver};

/// Knows which lights bring light in each cell, and leaves directions to the BSDF.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightGuided<'a> {
    pub(crate) lights: ByCells<'a>,
}

impl<'a> LightChooser for LightGuided<'a> {
    type Walk = CellWalk<'a>;

    #[inline]
    fn walk(&self, receiver: Receiver) -> CellWalk<'a> {
        self.lights.walk(receiver)
    }
}

impl Guide for LightGuided<'_> {
    type Knowledge = Unguided;
    type Trail = ();

    #[inline(always)]
    fn at(&self, _: Receiver) -> Unguided {
        Unguided
    }
}
