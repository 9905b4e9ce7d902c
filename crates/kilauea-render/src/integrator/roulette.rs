//! When paths end by chance.

use kilauea_math::Spectrum;

/// Paths may end after this many scattering events.
const MIN_DEPTH: u32 = 3;
/// Paths survive with their throughput times this, at most for sure: to end the moderately dim
/// ones adds more noise than the time they take is worth (decision 021).
const SURVIVAL_PER_THROUGHPUT: f32 = 2.0;
const MIN_SURVIVAL: f32 = 0.05;

/// Probability with which a path goes on that has scattered `depth` times before; `throughput` is the
/// share of light that it would bring then.
#[inline]
pub(super) fn survival(depth: u32, throughput: Spectrum) -> f32 {
    if depth + 1 >= MIN_DEPTH {
        survival_of(throughput)
    } else {
        1.0
    }
}

/// The same, however long the path is.
#[inline]
pub(super) fn survival_of(throughput: Spectrum) -> f32 {
    let survival = SURVIVAL_PER_THROUGHPUT * throughput.max_channel();
    if survival < 1.0 {
        survival.max(MIN_SURVIVAL)
    } else {
        1.0
    }
}
