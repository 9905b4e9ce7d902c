//! How many rays were traced.

use serde::{Deserialize, Serialize};

/// Rays traced, by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Toward lights.
    pub shadow: u64,
    /// Scattered.
    pub indirect: u64,
    /// Of all these, those that could not be traced.
    pub invalid: u64,
    /// Paths that were in more media at once than they can carry.
    pub in_too_many_media: u64,
}

/// [`RayCounts`] of one SPOT. Of these there are as many as SPOTs that wait, and none traces 2^32
/// rays.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayTally {
    pub(crate) camera: u32,
    pub(crate) shadow: u32,
    pub(crate) indirect: u32,
    pub(crate) invalid: u32,
    pub(crate) in_too_many_media: u32,
}

impl RayCounts {
    /// Adds the rays of others.
    pub(crate) fn add(&mut self, other: impl Into<Self>) {
        let other = other.into();
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.indirect += other.indirect;
        self.invalid += other.invalid;
        self.in_too_many_media += other.in_too_many_media;
    }
}

impl RayTally {
    /// Adds the rays of another SPOT.
    pub(crate) fn add(&mut self, other: Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.indirect += other.indirect;
        self.invalid += other.invalid;
        self.in_too_many_media += other.in_too_many_media;
    }
}

impl From<RayTally> for RayCounts {
    fn from(tally: RayTally) -> Self {
        Self {
            camera: u64::from(tally.camera),
            shadow: u64::from(tally.shadow),
            indirect: u64::from(tally.indirect),
            invalid: u64::from(tally.invalid),
            in_too_many_media: u64::from(tally.in_too_many_media),
        }
    }
}
