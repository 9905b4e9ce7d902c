//! Final-gather estimation: what is known of the light that arrives at a point before the final
//! paths are traced.
//!
//! Paths leave [`GatherRecord`]s. [`GatherField::fit`] divides the places where they scattered into
//! cells and fits to each cell what light it receives: a distribution over directions to draw from,
//! and the mean of what comes back. It knows no scene and no lights.

#![forbid(unsafe_code)]

mod cell_tree;
mod direction_tree;
mod field;
mod octahedral;
mod picture;
mod record;
mod reflection;

pub use direction_tree::DirectionTree;
pub use field::GatherField;
pub use picture::{PathError, PictureEstimate, PictureSample};
pub use record::GatherRecord;
pub use reflection::Reflection;
