//! Which material's shader panicked.

use std::future::poll_fn;
use std::pin::Pin;
use std::sync::OnceLock;

use crate::geometry::{Geometry, PrimitiveRef};

/// The material whose shader panicked first.
#[derive(Debug, Default)]
pub(crate) struct Blame {
    material: OnceLock<String>,
}

/// Says that a shader runs, until it is dropped.
pub(crate) struct Shading<'a> {
    blame: &'a Blame,
    geometry: &'a Geometry,
    at: PrimitiveRef,
}

impl Blame {
    /// The shader at `at` runs from now on.
    #[inline]
    pub(crate) fn shading<'a>(&'a self, geometry: &'a Geometry, at: PrimitiveRef) -> Shading<'a> {
        Shading {
            blame: self,
            geometry,
            at,
        }
    }

    /// Awaits the code of the shader at `at`, which runs only while it is polled.
    #[inline]
    pub(super) fn watch<F: Future>(
        &self,
        geometry: &Geometry,
        at: PrimitiveRef,
        mut shade: Pin<&mut F>,
    ) -> impl Future<Output = F::Output> {
        poll_fn(move |task| {
            let _shading = self.shading(geometry, at);
            shade.as_mut().poll(task)
        })
    }

    /// Path of the material whose shader panicked.
    pub(crate) fn material(&self) -> Option<&str> {
        self.material.get().map(String::as_str)
    }
}

impl Drop for Shading<'_> {
    #[inline]
    fn drop(&mut self) {
        if std::thread::panicking() {
            let path = self.geometry.material_path(self.at);
            self.blame.material.get_or_init(|| path.to_owned());
        }
    }
}
