//! What the samples of a frame become: pixel filters, layers, image files, and their comparison.
//!
//! ```
//! use kilauea_film::{Aov, Film, FilmSettings, PixelSample};
//! use kilauea_math::Spectrum;
//! use kilauea_scene::DataWindow;
//!
//! let film = Film::new(FilmSettings {
//!     resolution: [4, 2],
//!     data_window: DataWindow { min: [0, 0], max: [4, 2] },
//!     tile_size: 16,
//!     aovs: vec![Aov::Z],
//!     tracks_variance: false,
//! });
//! for tile_idx in 0..film.n_tiles() {
//!     let mut tile = film.tile(tile_idx);
//!     for pixel_idx in 0..tile.n_pixels() {
//!         tile.add(pixel_idx, &PixelSample { beauty: Spectrum::ONE, ..PixelSample::default() });
//!     }
//! }
//! assert_eq!(film.n_samples(), 8);
//! ```

#![forbid(unsafe_code)]

mod aov;
mod compare;
mod error;
mod exr_read;
mod exr_write;
mod film;
mod filter;
mod flip;
mod image;
mod metadata;
mod png_write;
mod replace;
mod sample;
mod tile;

pub use aov::{Aov, UnknownAov};
pub use compare::{Comparison, compare};
pub use error::ImageError;
pub use exr_read::read_exr;
pub use exr_write::{write_exr, write_image_exr};
pub use film::{Film, FilmSettings};
pub use filter::Filter;
pub use flip::hdr_flip;
pub use image::{Channel, Image};
pub use metadata::{ImageMetadata, Packing};
pub use png_write::write_png;
pub use sample::PixelSample;
pub use tile::{SumsError, Tile};
