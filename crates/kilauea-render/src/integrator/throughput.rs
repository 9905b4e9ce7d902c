//! The share of light that a path carries to the camera.

use kilauea_math::{PackedSpectrum, Spectrum};

use super::path_sample::PathSample;

/// Throughput, split at the first vertex so that each layer gets its share.
#[derive(Clone, Copy)]
pub(super) struct Throughput {
    /// Weights of the first scattering event.
    first_diffuse: PackedSpectrum,
    first_specular: PackedSpectrum,
    /// Product of all later events but the last.
    between: PackedSpectrum,
    /// Weights of the last event.
    last_diffuse: PackedSpectrum,
    last_specular: PackedSpectrum,
}

impl Throughput {
    pub(super) fn start() -> Self {
        Self {
            first_diffuse: PackedSpectrum::ONE,
            first_specular: PackedSpectrum::ONE,
            between: PackedSpectrum::ONE,
            last_diffuse: PackedSpectrum::ONE,
            last_specular: PackedSpectrum::BLACK,
        }
    }

    /// Arrives at the vertex after `depth` events: the last one becomes one of those between.
    pub(super) fn advance(&mut self, depth: u32) {
        if depth >= 2 {
            self.between *= self.last();
        }
    }

    /// Scatters at the vertex after `depth` events.
    pub(super) fn scatter(&mut self, depth: u32, diffuse: Spectrum, specular: Spectrum) {
        let (diffuse, specular) = (diffuse.into(), specular.into());
        if depth == 0 {
            (self.first_diffuse, self.first_specular) = (diffuse, specular);
        }
        (self.last_diffuse, self.last_specular) = (diffuse, specular);
    }

    /// Product of all events before the vertex after `depth` events, where the path has arrived.
    pub(super) fn arriving(&self, depth: u32) -> Spectrum {
        if depth == 0 {
            Spectrum::ONE
        } else {
            self.first() * self.between.unpack()
        }
    }

    /// Product of all events up to the one at the vertex after `depth` events.
    pub(super) fn total(&self, depth: u32) -> Spectrum {
        if depth == 0 {
            self.last()
        } else {
            self.first() * self.between.unpack() * self.last()
        }
    }

    /// What the last event scatters of light, by diffuse lobes and by all others.
    #[inline]
    pub(super) fn last_by_lobes(&self) -> [Spectrum; 2] {
        [self.last_diffuse.unpack(), self.last_specular.unpack()]
    }

    #[inline]
    fn first(&self) -> Spectrum {
        self.first_diffuse.unpack() + self.first_specular.unpack()
    }

    #[inline]
    fn last(&self) -> Spectrum {
        self.last_diffuse.unpack() + self.last_specular.unpack()
    }

    /// Scales the event at the vertex after `depth` events.
    pub(super) fn scale_last(&mut self, depth: u32, factor: Spectrum) {
        self.scale_last_by_lobes(depth, [factor; 2]);
    }

    /// The same for what diffuse lobes scattered and what others did.
    pub(super) fn scale_last_by_lobes(&mut self, depth: u32, [diffuse, specular]: [Spectrum; 2]) {
        self.last_diffuse *= diffuse;
        self.last_specular *= specular;
        if depth == 0 {
            self.first_diffuse *= diffuse;
            self.first_specular *= specular;
        }
    }

    /// Adds light that lobes scatter at the vertex after `depth` events, and that did not come to it
    /// straight from a light.
    #[inline]
    pub(super) fn add_indirect(
        &self,
        out: &mut PathSample,
        depth: u32,
        diffuse: Spectrum,
        specular: Spectrum,
    ) {
        if depth == 0 {
            out.indirect_diffuse += diffuse;
            out.indirect_specular += specular;
        } else {
            self.add(out, depth + 1, diffuse, specular);
        }
    }

    /// Adds light that arrives after `n_events` events, of which the last scattered that much of it
    /// by its lobes.
    #[inline]
    pub(super) fn add(
        &self,
        out: &mut PathSample,
        n_events: u32,
        diffuse: Spectrum,
        specular: Spectrum,
    ) {
        if n_events == 1 {
            out.direct_diffuse += diffuse;
            out.direct_specular += specular;
        } else {
            let radiance = self.between.unpack() * (diffuse + specular);
            out.indirect_diffuse += radiance * self.first_diffuse.unpack();
            out.indirect_specular += radiance * self.first_specular.unpack();
        }
    }
}
