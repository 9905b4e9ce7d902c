//! Final-gather estimation: what is known of the light that arrives at a point before the final
//! paths are traced.
//!
//! Paths leave [`GatherRecord`]s. [`GatherField::fit`] divides the places where they scattered into
//! cells and fits to each cell a distribution over the directions from which it receives light.
//! [`ChoiceRecord`]s are of lights that paths chose, fork by fork; [`ChoiceField::fit`] weighs the ways of
//! each fork, cell by cell. [`forecast`] and [`forecast_choice`] tell beforehand whether either is of
//! use. It knows no scene and no lights.

#![forbid(unsafe_code)]

mod aim_field;
mod cell_tree;
mod choice_field;
mod choice_forecast;
mod choice_record;
mod direction_tree;
mod directions;
mod field;
mod forecast;
mod lobe;
mod picture;
mod record;

pub use aim_field::AimField;
pub use choice_field::{CellChoice, ChoiceField};
pub use choice_forecast::{ChoiceForecast, PLAIN_CHOICES, forecast_choice};
pub use choice_record::{ChoiceRecord, ChoiceRecords, Turn};
pub use direction_tree::DirectionTree;
pub use directions::Directions;
pub use field::GatherField;
pub use forecast::forecast;
pub use lobe::Lobe;
pub use picture::{PathError, PictureEstimate, PictureSample, SquaredDifference};
pub use record::{Arrival, GatherRecord};
