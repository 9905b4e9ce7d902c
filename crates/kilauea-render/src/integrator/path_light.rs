use std::pin::Pin;
use std::task::{Context, Poll};

use kilauea_math::{PackedSpectrum, Spectrum};
use kilauea_shading::Scattered;

/// The light that comes along a path, as far as it is known when the path goes on. It is there at
/// once; a shader may keep it for as long as it waits for other light.
#[derive(Clone, Copy)]
pub(super) struct PathLight {
    /// What stands for light that the path does not bring.
    pub(super) estimate: PackedSpectrum,
    /// Whether it brings any.
    pub(super) goes_on: bool,
}

impl PathLight {
    /// None: the path ends.
    pub(super) const NOTHING: Self = Self {
        estimate: PackedSpectrum::BLACK,
        goes_on: false,
    };

    /// All that the path brings.
    pub(super) const BY_PATH: Self = Self {
        goes_on: true,
        ..Self::NOTHING
    };
}

impl Future for PathLight {
    type Output = Scattered;

    #[inline(always)]
    fn poll(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Scattered> {
        Poll::Ready(Scattered {
            diffuse: self.estimate.unpack(),
            specular: Spectrum::BLACK,
            path: if self.goes_on {
                Spectrum::ONE
            } else {
                Spectrum::BLACK
            },
        })
    }
}
