use kilauea_film::Image;
use kilauea_render::{PreparedScene, RenderStats};
use kilauea_scene::{RenderSettings, Shading};
use std::sync::Arc;

/// A rendered frame.
#[derive(Debug)]
pub struct Picture {
    /// Its channels.
    pub image: Image,
    /// Its statistics.
    pub stats: RenderStats,
}

impl Picture {
    /// Values of a channel, which must be there.
    pub fn channel(&self, name: &str) -> &[f32] {
        self.image
            .channel(name)
            .unwrap_or_else(|| panic!("no channel {name}"))
    }

    /// Mean of a channel.
    pub fn mean_of(&self, name: &str) -> f64 {
        let values = self.channel(name);
        values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
    }

    /// Mean of red, green and blue.
    pub fn mean(&self) -> f64 {
        ["R", "G", "B"].map(|c| self.mean_of(c)).iter().sum::<f64>() / 3.0
    }

    /// Fails where a value of the picture is NaN or infinite. Depth is infinite where nothing is
    /// hit, and the variance of a single sample too.
    pub fn check_finite(&self, what: &str) {
        for channel in &self.image.channels {
            let may_be_infinite = matches!(channel.name.as_str(), "Z" | "variance");
            let is_bad = |v: &f32| v.is_nan() || (v.is_infinite() && !may_be_infinite);
            let n_bad = channel.samples.iter().filter(|v| is_bad(v)).count();
            assert_eq!(n_bad, 0, "{what}: {} values of {}", n_bad, channel.name);
        }
    }

    /// All channels as bits, for comparisons that forgive nothing.
    pub fn bits(&self) -> Vec<(&str, Vec<u32>)> {
        let bits = |samples: &[f32]| samples.iter().map(|v| v.to_bits()).collect();
        self.image
            .channels
            .iter()
            .map(|c| (c.name.as_str(), bits(&c.samples)))
            .collect()
    }

    /// Fails at the first channel in which two pictures differ.
    pub fn check_same_bits(&self, other: &Self, what: &str) {
        let (ours, theirs) = (self.bits(), other.bits());
        assert_eq!(ours.len(), theirs.len(), "{what}");
        for (a, b) in ours.iter().zip(&theirs) {
            assert_eq!(a.0, b.0, "{what}");
            let n_different = a.1.iter().zip(&b.1).filter(|(a, b)| a != b).count();
            assert_eq!(n_different, 0, "{what}: pixels of {} that differ", a.0);
        }
    }
}

impl Picture {
    /// Renders with one thread, and fails where more threads or other ways of answering change a bit.
    pub fn check_ways_of_rendering(
        prepared: &Arc<PreparedScene>,
        settings: &RenderSettings,
    ) -> Self {
        let render = |threads, shading| {
            let settings = RenderSettings {
                threads,
                shading,
                ..settings.clone()
            };
            Self::render(prepared, settings)
        };
        let one = render(1, Shading::Inline);
        for (threads, shading) in [
            (2, Shading::Inline),
            (7, Shading::Inline),
            (2, Shading::Queued),
            (2, Shading::Bytes),
        ] {
            let what = format!("{threads} threads, {shading:?}");
            one.check_same_bits(&render(threads, shading), &what);
        }
        one
    }
}

/// Fails where `found` is further than a fraction from `expected`.
pub fn check_near(found: f64, expected: f64, fraction: f64, what: &str) {
    let error = (found - expected).abs() / expected.abs().max(1e-30);
    assert!(
        error <= fraction,
        "{what}: {found}, expected {expected}: off by {:.3} %",
        100.0 * error
    );
}

/// Mean of (a − b)² / (b² + 0.01) over red, green and blue.
pub fn rel_mse(a: &Picture, b: &Picture) -> f64 {
    let terms = ["R", "G", "B"].into_iter().flat_map(|c| {
        a.channel(c).iter().zip(b.channel(c)).map(|(&a, &b)| {
            let (a, b) = (f64::from(a), f64::from(b));
            (a - b).powi(2) / (b * b + 0.01)
        })
    });
    terms.sum::<f64>() / (3 * a.channel("R").len()) as f64
}
