use std::future::ready;

use kilauea_bsdf::{BsdfEval, Mirror, SeenBsdf};
use kilauea_math::Spectrum;

use super::{Merge, SharedConnection};
use crate::integrator::guide::Knowledge;
use crate::integrator::question::{Answer, Question};
use crate::integrator::walk::{Segment, Vertex};
use crate::light::{ChosenLight, Emitted};
use crate::sampler::Sampler;

/// There are no photons, at no cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unmerged;

impl Merge for Unmerged {
    type Eye = ();
    type Asked<R, K> = ();

    #[inline(always)]
    fn start(&self) {}

    #[inline(always)]
    fn gather<M, R, K: Knowledge>(
        &self,
        (): &mut (),
        _: &Vertex<'_, M>,
        _: (&SeenBsdf, &K),
        _: impl FnOnce(Question) -> R,
        (): &mut (),
    ) -> bool {
        false
    }

    #[inline(always)]
    fn receive<R, K: Knowledge>(&self, (): &mut (), (): &mut ()) -> impl Future<Output = ()>
    where
        R: Future<Output = Answer> + Unpin,
    {
        ready(())
    }

    #[inline(always)]
    fn take((): &mut ()) -> Option<[Spectrum; 2]> {
        None
    }

    #[inline(always)]
    fn depart<M>(
        &self,
        (): &mut (),
        _: Segment<'_>,
        _: &Vertex<'_, M>,
        _: [&SeenBsdf; 2],
        _: &Sampler<'_>,
    ) -> [Spectrum; 2] {
        [Spectrum::ONE; 2]
    }

    #[inline(always)]
    fn weight_of_hit(&self, (): &(), _: Option<Segment<'_>>, _: &Emitted, _: f32) -> Option<f32> {
        None
    }

    #[inline(always)]
    fn weight_of_connection<M>(
        &self,
        (): &(),
        _: &Vertex<'_, M>,
        _: (&SeenBsdf, &BsdfEval),
        _: &ChosenLight,
        _: f32,
    ) -> Option<SharedConnection> {
        None
    }

    #[inline(always)]
    fn weight_of_mirrored<M>(
        &self,
        (): &(),
        _: &Vertex<'_, M>,
        _: &Mirror,
        _: Option<u32>,
    ) -> Option<f32> {
        None
    }
}
