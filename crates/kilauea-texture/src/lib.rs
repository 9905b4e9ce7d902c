//! Images for lookup: tile files, read when a ray first needs them, within a memory budget.
//!
//! [`TextureStore`] opens the *tile files* that a host prepares once per image, reads nothing but
//! their headers, and loads 64×64-texel tiles as lookups touch them. A lookup of a resident tile
//! takes no lock; when the tiles outgrow the budget, the ones not used lately make room. Neither
//! the budget nor the number of threads changes a value.
//!
//! # Tile files, version 1
//! All numbers are little-endian.
//!
//! | offset | type | what |
//! |---|---|---|
//! | 0 | 8 bytes | `KLTILES\0` |
//! | 8 | u32 | version, 1 |
//! | 12 | u32 × 2 | width and height in texels |
//! | 20 | u32 | channels: 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA |
//! | 24 | u32 | element type: 0 u8 (unsigned normalised), 1 f16, 2 f32 |
//! | 28 | u32 | transfer: 0 linear, 1 sRGB (u8 only; alpha is always linear) |
//! | 32 | u32 × 2 | horizontal and vertical wrap mode in the image's metadata: 0 none, 1 black, 2 clamp, 3 repeat, 4 mirror; for the host that wrote the file |
//! | 40 | u32 | mip levels, finest first |
//! | 44 | u32 | 0 |
//! | 48 | 16 bytes each | per level: u32 width, u32 height, u64 offset of its first tile |
//!
//! Level *l* is max(1, ⌊width / 2^l⌋) texels wide, and likewise high. The first row is the lowest:
//! st (0, 0) is the outer corner of the first texel. A level's tiles follow one another in rows
//! from the first texel on; the texels of a tile are contiguous, row by row. Tiles at the upper and
//! right border end where the image ends, so a level takes exactly width × height texels.

#![forbid(unsafe_code)]

mod cache;
mod error;
mod header;
mod image;
mod lookup;
mod store;
#[cfg(test)]
mod testing;
mod texel;
mod tiles;
mod wrap;

pub use cache::TextureStats;
pub use error::TextureError;
pub use header::TILE_SIZE;
pub use kilauea_scene::Wrap;
pub use store::{LevelTexels, TextureStore};
pub use tiles::TileId;
