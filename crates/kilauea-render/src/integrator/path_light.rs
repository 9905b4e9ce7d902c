use std::pin::Pin;
use std::task::{Context, Poll};

use kilauea_shading::Scattered;

/// The light that comes along a path, as far as it is known when the path goes on. It is there at
/// once; a shader may keep it for as long as it waits for other light.
#[derive(Clone, Copy)]
pub(super) struct PathLight {
    /// Whether it brings any.
    pub(super) goes_on: bool,
}

impl PathLight {
    /// None: the path ends.
    pub(super) const NOTHING: Self = Self { goes_on: false };

    /// All that the path brings.
    pub(super) const BY_PATH: Self = Self { goes_on: true };
}

impl Future for PathLight {
    type Output = Scattered;

    #[inline(always)]
    fn poll(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Scattered> {
        Poll::Ready(if self.goes_on {
            Scattered::BY_PATH
        } else {
            Scattered::NOTHING
        })
    }
}
