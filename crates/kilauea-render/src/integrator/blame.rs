//! Which material's shader panicked.

use std::pin::Pin;
use std::sync::OnceLock;
use std::task::{Context, Poll};

use crate::geometry::PrimitiveRef;

/// The surface whose shader panicked first.
#[derive(Debug, Default)]
pub(crate) struct Blame {
    at: OnceLock<PrimitiveRef>,
}

/// Says that a shader runs, until it is dropped.
pub(crate) struct Shading<'a> {
    blame: &'a Blame,
    at: PrimitiveRef,
}

/// The code of a shader, which runs only while it is polled.
pub(super) struct Watched<'a, F> {
    blame: &'a Blame,
    at: PrimitiveRef,
    shade: Pin<&'a mut F>,
}

impl Blame {
    /// The shader at `at` runs from now on.
    #[inline]
    pub(crate) fn shading(&self, at: PrimitiveRef) -> Shading<'_> {
        Shading { blame: self, at }
    }

    /// Awaits the code of the shader at `at`.
    #[inline]
    pub(super) fn watch<'a, F>(
        &'a self,
        at: PrimitiveRef,
        shade: Pin<&'a mut F>,
    ) -> Watched<'a, F> {
        Watched {
            blame: self,
            at,
            shade,
        }
    }

    /// Where a shader panicked.
    pub(crate) fn surface(&self) -> Option<PrimitiveRef> {
        self.at.get().copied()
    }
}

impl Drop for Shading<'_> {
    #[inline]
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.blame.at.get_or_init(|| self.at);
        }
    }
}

impl<F: Future> Future for Watched<'_, F> {
    type Output = F::Output;

    #[inline(always)]
    fn poll(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<F::Output> {
        let _shading = self.blame.shading(self.at);
        self.shade.as_mut().poll(task)
    }
}
