//! Rust errors as Python exceptions.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::{PyErr, create_exception};

create_exception!(
    kilauea._native,
    SceneError,
    PyValueError,
    "A scene that cannot be rendered."
);
create_exception!(
    kilauea._native,
    RenderError,
    PyRuntimeError,
    "A frame that could not be rendered or written."
);

/// A scene error with the text of `error`.
pub(crate) fn scene_error(error: impl std::fmt::Display) -> PyErr {
    SceneError::new_err(error.to_string())
}

/// A render error with the text of `error`.
pub(crate) fn render_error(error: impl std::fmt::Display) -> PyErr {
    RenderError::new_err(error.to_string())
}
