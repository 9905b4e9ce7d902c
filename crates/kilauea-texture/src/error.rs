use std::io;
use std::path::PathBuf;

/// What is wrong with an image. Where its tile file cannot be used, lookups find no image.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// It cannot be read.
    #[error("{image}: cannot read {}: {source}", tiles.display())]
    Io {
        /// The image as authored.
        image: String,
        /// The tile file.
        tiles: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It is not a tile file, or a damaged one.
    #[error("{image}: {} is no valid tile file: {reason}", tiles.display())]
    Corrupt {
        /// The image as authored.
        image: String,
        /// The tile file.
        tiles: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A UDIM number outside 1001 to 1100.
    #[error("{image}: {udim} is no UDIM tile number")]
    Udim {
        /// The image as authored.
        image: String,
        /// The number.
        udim: u32,
    },
    /// Some of it was no number; the rest is used.
    #[error("{image}: {n_values} values are not finite: NaN reads as 0, infinity as 65504")]
    NotFinite {
        /// The image as authored.
        image: String,
        /// Values of its finest level, each channel by itself.
        n_values: u32,
    },
}
