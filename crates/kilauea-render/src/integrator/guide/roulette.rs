//! When paths may end by chance.

use kilauea_math::Spectrum;

use super::Roulette;

/// Paths may end after this many scattering events.
const MIN_DEPTH: u32 = 3;
/// Paths survive with their throughput times this, at most for sure: to end the moderately dim
/// ones adds more noise than the time they take is worth (decision 021).
const SURVIVAL_PER_THROUGHPUT: f32 = 2.0;
const MIN_SURVIVAL: f32 = 0.05;
/// A cell that found little may have missed something: paths go on in one of so many cases.
const MIN_BENEFIT: f32 = 0.3;

impl Roulette {
    /// By the light that the path carries alone.
    #[inline]
    pub(super) fn by_throughput(depth: u32, throughput: Spectrum) -> Option<Self> {
        let survival = survival_by_throughput(depth, throughput);
        (survival < 1.0).then_some(Self {
            survival,
            estimate: None,
        })
    }

    /// By what is still to be found as well: `benefit` is the error that the rest of the path takes
    /// away, per cost, over what paths of the picture take away on the whole (Rath et al. 2022,
    /// "EARS: Efficiency-Aware Russian Roulette and Splitting", with the error of `estimate` in
    /// place of the second moment).
    #[inline]
    pub(super) fn by_residual(
        depth: u32,
        throughput: Spectrum,
        benefit: f32,
        estimate: Spectrum,
    ) -> Option<Self> {
        if depth == 0 {
            return None;
        }
        let survival = survival_by_throughput(depth, throughput).min(benefit.max(MIN_BENEFIT));
        (survival < 1.0).then_some(Self {
            survival,
            estimate: Some(estimate),
        })
    }
}

#[inline]
fn survival_by_throughput(depth: u32, throughput: Spectrum) -> f32 {
    let survival = SURVIVAL_PER_THROUGHPUT * throughput.max_channel();
    if depth + 1 >= MIN_DEPTH && survival < 1.0 {
        survival.max(MIN_SURVIVAL)
    } else {
        1.0
    }
}
