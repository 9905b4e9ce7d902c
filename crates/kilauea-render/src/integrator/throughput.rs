//! The share of light that a path carries to the camera.

use kilauea_film::PixelSample;
use kilauea_math::Spectrum;

/// Throughput, split at the first vertex so that each layer gets its share.
#[derive(Clone, Copy)]
pub(super) struct Throughput {
    /// Weights of the first scattering event.
    first_diffuse: Spectrum,
    first_specular: Spectrum,
    /// Product of all later events but the last.
    between: Spectrum,
    /// Weights of the last event.
    pub(super) last_diffuse: Spectrum,
    pub(super) last_specular: Spectrum,
}

impl Throughput {
    pub(super) fn start() -> Self {
        Self {
            first_diffuse: Spectrum::ONE,
            first_specular: Spectrum::ONE,
            between: Spectrum::ONE,
            last_diffuse: Spectrum::ONE,
            last_specular: Spectrum::BLACK,
        }
    }

    /// Arrives at the vertex after `depth` events: the last one becomes one of those between.
    pub(super) fn advance(&mut self, depth: u32) {
        if depth >= 2 {
            self.between *= self.last_diffuse + self.last_specular;
        }
    }

    /// Scatters at the vertex after `depth` events.
    pub(super) fn scatter(&mut self, depth: u32, diffuse: Spectrum, specular: Spectrum) {
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
            (self.first_diffuse + self.first_specular) * self.between
        }
    }

    /// Product of all events up to the one at the vertex after `depth` events.
    pub(super) fn total(&self, depth: u32) -> Spectrum {
        let last = self.last_diffuse + self.last_specular;
        if depth == 0 {
            last
        } else {
            (self.first_diffuse + self.first_specular) * self.between * last
        }
    }

    /// Scales the event at the vertex after `depth` events.
    pub(super) fn scale_last(&mut self, depth: u32, factor: Spectrum) {
        self.last_diffuse *= factor;
        self.last_specular *= factor;
        if depth == 0 {
            self.first_diffuse *= factor;
            self.first_specular *= factor;
        }
    }

    /// Adds light that lobes scatter at the vertex after `depth` events, and that did not come to it
    /// straight from a light.
    #[inline]
    pub(super) fn add_indirect(
        &self,
        out: &mut PixelSample,
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
        out: &mut PixelSample,
        n_events: u32,
        diffuse: Spectrum,
        specular: Spectrum,
    ) {
        if n_events == 1 {
            out.direct_diffuse += diffuse;
            out.direct_specular += specular;
        } else {
            let radiance = self.between * (diffuse + specular);
            out.indirect_diffuse += radiance * self.first_diffuse;
            out.indirect_specular += radiance * self.first_specular;
        }
    }
}
