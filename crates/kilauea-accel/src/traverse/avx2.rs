//! Kernels for x86-64 processors with AVX2 and FMA.
#![allow(
    unsafe_code,
    reason = "vector loads, unchecked links and the uninitialised stack of the hot loops"
)]

#[cfg(target_arch = "x86_64")]
mod position;
#[cfg(target_arch = "x86_64")]
mod storage;
#[cfg(target_arch = "x86_64")]
mod x86;
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::Avx2;

#[cfg(not(target_arch = "x86_64"))]
mod absent {
    use crate::node::Node8;
    use crate::ray::{Hit, Ray};
    use crate::traverse::{Keep, Line, Scene, TreeRay, Visitor};

    /// Kernels that this processor family does not have: no value exists.
    #[derive(Clone, Copy, Debug)]
    pub(crate) enum Avx2 {}

    impl Avx2 {
        pub(crate) fn detect() -> Option<Self> {
            None
        }

        pub(crate) fn coherent(self) -> Self {
            match self {}
        }

        pub(crate) fn pierce<L: Line>(self, _: &[Node8], _: &TreeRay<L>, _: &mut impl Visitor) {
            match self {}
        }

        pub(crate) fn closest<L: Line>(
            self,
            _: Scene<'_>,
            _: (&Ray, impl FnOnce() -> TreeRay<L>),
            _: impl Keep,
        ) -> Option<Hit> {
            match self {}
        }

        pub(crate) fn occluded<L: Line>(
            self,
            _: Scene<'_>,
            _: (&Ray, impl FnOnce() -> TreeRay<L>),
            _: impl Keep,
        ) -> bool {
            match self {}
        }
    }
}
#[cfg(not(target_arch = "x86_64"))]
pub(crate) use absent::Avx2;
