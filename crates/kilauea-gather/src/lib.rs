//! Final-gather estimation: what is known of the light that arrives at a point before the final
//! paths are traced.
//!
//! Paths leave [`GatherRecord`]s. [`GatherField::fit`] divides the places where they scattered into
//! cells and fits to each cell a distribution over the directions from which it receives light.
//! [`forecast`] tells beforehand whether that is of use. It knows no scene and no lights.

#![forbid(unsafe_code)]

mod aim_field;
mod cell_tree;
mod direction_tree;
mod field;
mod forecast;
mod octahedral;
mod picture;
mod record;

pub use aim_field::AimField;
pub use direction_tree::DirectionTree;
pub use field::GatherField;
pub use forecast::forecast;
pub use picture::{PathError, PictureEstimate, PictureSample};
pub use record::{Arrival, GatherRecord};
