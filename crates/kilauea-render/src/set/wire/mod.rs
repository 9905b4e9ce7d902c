//! Questions to a member and its answers, as bytes: little-endian, column by column.

mod columns;
mod frame;
mod photons;
mod rays;
mod replies;
#[cfg(test)]
mod tests;

pub use frame::Packing;
pub(crate) use frame::{pack, unpack};
pub(crate) use photons::may_be_cut;
pub(crate) use rays::{decode_questions, encode_questions};
pub(crate) use replies::{Replies, decode_answers};

/// Questions in a batch, at most: bounds what a decoder takes.
pub(crate) const MAX_BATCH: usize = 8192;
