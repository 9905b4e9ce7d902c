use std::io;
use std::path::{Path, PathBuf};

/// Why an image could not be written, read or compared.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file system said no.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The image.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Not a readable EXR file, or not a writable image.
    #[error("{path}: {source}", path = path.display())]
    Exr {
        /// The image.
        path: PathBuf,
        /// What the codec said.
        source: exr::error::Error,
    },
    /// The PNG encoder said no.
    #[error("{path}: {source}", path = path.display())]
    Png {
        /// The image.
        path: PathBuf,
        /// What the encoder said.
        source: png::EncodingError,
    },
    /// The file has nothing that this program can compare.
    #[error("{path}: {reason}", path = path.display())]
    Unsupported {
        /// The image.
        path: PathBuf,
        /// What is in the way.
        reason: String,
    },
    /// The data window holds no pixel.
    #[error("the data window is empty")]
    Empty,
    /// No R, G and B that stand for the picture.
    #[error("no red, green and blue of the picture among the channels: {channels}")]
    NoBeauty {
        /// What there is instead.
        channels: String,
    },
    /// The two images do not show the same pixels.
    #[error(
        "the images differ in size: {}x{} at {:?} and {}x{} at {:?}",
        a.0[0], a.0[1], a.1, b.0[0], b.0[1], b.1
    )]
    SizeMismatch {
        /// Size and first pixel of the first data window.
        a: ([usize; 2], [i32; 2]),
        /// The same of the second.
        b: ([usize; 2], [i32; 2]),
    },
}

impl ImageError {
    /// An error of the EXR codec on the file at `path`; what the file system said is taken out.
    pub(crate) fn from_exr(path: &Path, source: exr::error::Error) -> Self {
        let path = path.to_owned();
        match source {
            exr::error::Error::Io(source) => Self::Io { path, source },
            source => Self::Exr { path, source },
        }
    }
}
