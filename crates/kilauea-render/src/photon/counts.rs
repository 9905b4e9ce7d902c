use serde::Serialize;

/// What was done to trace photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PhotonCounts {
    /// Paths that lights sent out.
    pub emitted: u64,
    /// Photons kept: those that came over specular surfaces alone.
    pub stored_caustic: u64,
    /// All others that were kept.
    pub stored_global: u64,
    /// Rays traced.
    pub rays: u64,
    /// Of these, those that could not be traced.
    pub invalid_rays: u64,
    /// Paths that were in more media at once than they can carry.
    pub in_too_many_media: u64,
}

impl PhotonCounts {
    /// Photons kept.
    pub fn stored(&self) -> u64 {
        self.stored_caustic + self.stored_global
    }

    /// Adds those of others.
    pub(super) fn add(&mut self, other: &Self) {
        self.emitted += other.emitted;
        self.stored_caustic += other.stored_caustic;
        self.stored_global += other.stored_global;
        self.rays += other.rays;
        self.invalid_rays += other.invalid_rays;
        self.in_too_many_media += other.in_too_many_media;
    }
}
