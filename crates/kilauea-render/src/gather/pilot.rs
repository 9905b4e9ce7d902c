use kilauea_gather::{PathError, PictureEstimate, PictureSample};

use crate::frame::Frame;

/// What plain paths tell of the picture.
pub(super) struct Pilot {
    pub(super) picture: PictureEstimate,
    /// Error of one of its paths.
    pub(super) plain: PathError,
    pub(super) n_paths: usize,
}

impl Pilot {
    /// None where nothing is seen.
    pub(super) fn of(frame: &Frame, samples: &[PictureSample]) -> Option<Self> {
        let window = frame.film.data_window();
        let picture = PictureEstimate::fit(window.min, window.max, samples)?;
        let plain = picture.error_of(samples)?;
        Some(Self {
            picture,
            plain,
            n_paths: samples.len(),
        })
    }
}
