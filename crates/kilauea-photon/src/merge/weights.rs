/// The effective area of merging η and the share below which merging leaves a path to the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Merging {
    eta: f32,
    min_share: f32,
}

impl Merging {
    /// For `n_emitted` paths and merging within `radius`.
    ///
    /// Where merging would get less than `min_share` of the weight, it gets none (idea: Grittmann et
    /// al. 2018, "Efficient Caustic Rendering with Lightweight Photon Mapping"): such photons need
    /// not be stored or looked at.
    pub fn new(n_emitted: u64, radius: f32, min_share: f32) -> Self {
        Self {
            eta: n_emitted as f32 * std::f32::consts::PI * radius * radius,
            min_share,
        }
    }

    /// For photons that find all by themselves.
    pub fn alone() -> Self {
        Self {
            eta: 1e25,
            min_share: 0.0,
        }
    }

    /// For photons that nothing is left to.
    pub fn never() -> Self {
        Self {
            eta: 0.0,
            min_share: f32::INFINITY,
        }
    }

    /// Weight of a photon that carries `d_eye`, where the eye samples the direction to it with the
    /// density `pdf`.
    #[inline]
    pub fn weight_of_photon(self, d_eye: f32, pdf: f32) -> f32 {
        self.kept_share(self.eta / (self.eta + d_eye * pdf))
    }

    /// Weight of what the eye finds by hitting and by connecting together, where `d_light` is a path's own with
    /// the sum of both densities as that of its last direction. How either shares that is free.
    #[inline]
    pub fn weight_of_eye(self, d_light: f32) -> f32 {
        // No overflow: the densities of tiny lights are huge.
        1.0 - self.kept_share(1.0 / (1.0 + 1.0 / (self.eta * d_light)))
    }

    fn kept_share(self, share: f32) -> f32 {
        // None where nothing finds the path at all, which is not a number.
        if share >= self.min_share { share } else { 0.0 }
    }
}
