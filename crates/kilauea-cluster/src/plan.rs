//! How a frame is cut into units.

use kilauea_render::{CollectedFrame, may_have_photons_by_pass};
use kilauea_scene::RenderSettings;

/// Units for each engine thread, at least, so that none waits long for the last one.
const UNITS_PER_THREAD: u32 = 16;

/// Where units begin and end, and in which order they may be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Plan {
    /// Tiles of the frame.
    pub(crate) n_tiles: u32,
    /// Passes at which units end, ascending; the last is the number of passes.
    pub(crate) cuts: Vec<u32>,
    /// Whether a pass over all tiles must be done before the next begins, as each pass has its own
    /// photons.
    pub(crate) in_step: bool,
    /// Whether the same unit has the same result whoever renders it. Not so where a clock decides
    /// how long workers train.
    pub(crate) is_repeatable: bool,
}

impl Plan {
    /// The plan for `n_threads` engine threads in all.
    ///
    /// A unit has all passes over its tile where nothing speaks against it: the fewer units, the less
    /// is sent. Under a time limit, where photons are traced for each pass, and where each pass decides
    /// which pixels get more, it has one.
    pub(crate) fn new(frame: &CollectedFrame, settings: &RenderSettings, n_threads: u32) -> Self {
        let (n_tiles, n_passes) = (frame.n_tiles(), frame.n_passes());
        let has_limit = settings.time_limit_secs.is_some();
        let in_step = may_have_photons_by_pass(settings);
        let n_cuts = if has_limit || in_step || settings.noise.is_some() {
            n_passes
        } else {
            let wanted = n_threads.saturating_mul(UNITS_PER_THREAD);
            wanted.div_ceil(n_tiles.max(1)).clamp(1, n_passes)
        };
        Self {
            n_tiles,
            cuts: (1..=n_cuts)
                .map(|i| (u64::from(i) * u64::from(n_passes) / u64::from(n_cuts)) as u32)
                .collect(),
            in_step,
            is_repeatable: !has_limit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_scene::{CausticStrategy, GlobalIllumination, PhotonSettings};

    fn plan(settings: &RenderSettings, n_threads: u32) -> Plan {
        let frame = CollectedFrame::new(settings).unwrap();
        Plan::new(&frame, settings, n_threads)
    }

    #[test]
    fn units_are_as_large_as_they_may_be() {
        let settings = RenderSettings {
            resolution: [256, 128],
            samples_per_pixel: 64,
            photons: PhotonSettings {
                found_by: CausticStrategy::Paths,
                ..PhotonSettings::default()
            },
            ..RenderSettings::default()
        };
        let whole = plan(&settings, 2);
        assert_eq!((whole.n_tiles, &whole.cuts[..]), (32, &[8][..]));
        assert_eq!(plan(&settings, 4).cuts, [4, 8]);
        assert_eq!(plan(&settings, 100).cuts, [1, 2, 3, 4, 5, 6, 7, 8]);

        let limited = RenderSettings {
            time_limit_secs: Some(3.0),
            ..settings.clone()
        };
        assert_eq!(plan(&limited, 1).cuts.len(), 8);
        assert!(!plan(&limited, 1).is_repeatable && !plan(&limited, 1).in_step);
        for gi in [GlobalIllumination::Consistent, GlobalIllumination::Exact] {
            let photons = RenderSettings {
                gi,
                photons: PhotonSettings::default(),
                ..settings.clone()
            };
            assert!(plan(&photons, 1).in_step && plan(&photons, 1).cuts.len() == 8);
        }
    }
}
