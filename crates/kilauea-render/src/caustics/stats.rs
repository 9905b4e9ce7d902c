use serde::Serialize;

/// What photons did for the caustics of a frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CausticStats {
    /// Paths that lights sent out.
    pub emitted: u64,
    /// Photons kept of them, in all passes.
    pub stored: u64,
    /// How far photons were merged with in the first pass, in scene units.
    pub first_radius: f32,
    /// The same in the last one.
    pub last_radius: f32,
    /// Why there are none, where they were asked for.
    pub skipped: Vec<String>,
    /// Seconds of wall time for tracing them and building their maps.
    #[serde(skip)]
    pub(crate) seconds: f64,
    /// Rays traced for them.
    #[serde(skip)]
    pub(crate) rays: u64,
    /// Of the largest map.
    #[serde(skip)]
    pub(crate) bytes_peak: u64,
}
