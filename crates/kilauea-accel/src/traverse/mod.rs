//! The walks: one source, compiled once for every kernel.

mod avx2;
mod general;
mod keep;
mod kernel;
mod portable;
mod search;
#[cfg(test)]
mod slab_tests;
mod stack;
mod tree_leaves;
mod tree_ray;
pub(crate) mod triangle;
mod two_level;
mod walk;

pub(crate) use avx2::Avx2;
pub(crate) use general::Part;
pub(crate) use keep::{Keep, KeepAll};
pub(crate) use kernel::{Distances, Kernel};
pub(crate) use portable::Portable;
pub(crate) use tree_ray::{Ball, Line, TreeRay};
pub(crate) use two_level::{Instance, Scene};
pub(crate) use walk::Visitor;

use crate::node::Node8;
use crate::ray::{Hit, Ray};

/// Which kernels an accelerator runs, decided once.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Isa {
    Avx2(Avx2),
    Portable(Portable),
}

impl Isa {
    /// The widest kernels that this processor has.
    pub(crate) fn detect(simd: bool) -> Self {
        match Avx2::detect() {
            Some(avx2) if simd => Self::Avx2(avx2),
            _ => Self::Portable(Portable),
        }
    }

    /// `COHERENT` is whether the rays go much like those before them.
    #[inline(always)]
    pub(crate) fn closest<const COHERENT: bool, L: Line>(
        self,
        scene: Scene<'_>,
        rays: (&Ray, impl FnOnce() -> TreeRay<L>),
        mut keep: impl Keep,
    ) -> Option<Hit> {
        match self {
            Self::Avx2(avx2) if COHERENT => avx2.coherent().closest(scene, rays, keep),
            Self::Avx2(avx2) => avx2.closest(scene, rays, keep),
            Self::Portable(portable) => {
                portable.closest(scene, rays.0, rays.1().moved(), &mut |hit| keep.keep(hit))
            }
        }
    }

    #[inline(always)]
    pub(crate) fn occluded<L: Line>(
        self,
        scene: Scene<'_>,
        rays: (&Ray, impl FnOnce() -> TreeRay<L>),
        mut keep: impl Keep,
    ) -> bool {
        match self {
            Self::Avx2(avx2) => avx2.occluded(scene, rays, keep),
            Self::Portable(portable) => {
                portable.occluded(scene, rays.0, rays.1().moved(), &mut |hit| keep.keep(hit))
            }
        }
    }

    /// Visits leaves of a tree over boxes that the ray pierces, in any order, until one ends that.
    #[inline(always)]
    pub(crate) fn pierce<L: Line>(
        self,
        nodes: &[Node8],
        ray: &TreeRay<L>,
        visitor: &mut impl Visitor,
    ) {
        match self {
            Self::Avx2(avx2) => avx2.pierce(nodes, ray, visitor),
            Self::Portable(portable) => portable.pierce(nodes, ray, visitor),
        }
    }
}
