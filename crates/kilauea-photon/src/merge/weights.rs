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

    /// Weight of hitting a light, where `d_light` is the path's own, `pdf` the density with which the
    /// last BSDF sampled the direction to the light and `connect_pdf` that of connecting, zero if
    /// nothing connects.
    #[inline]
    pub fn weight_of_hit(self, d_light: f32, pdf: f32, connect_pdf: f32) -> f32 {
        self.weight_beside(1.0, connect_pdf / pdf, self.eta * d_light)
    }

    /// Weight of connecting to a light: as for [`weight_of_hit`](Self::weight_of_hit), with the
    /// densities in each other's place. `d_light` is of the path that connects, so with
    /// `connect_pdf` as the density of its last direction.
    #[inline]
    pub fn weight_of_connection(self, d_light: f32, pdf: f32, connect_pdf: f32) -> f32 {
        self.weight_beside(1.0, pdf / connect_pdf, self.eta * d_light)
    }

    /// Weight of a strategy with the density `own` beside another of the eye and merging.
    fn weight_beside(self, own: f32, other: f32, merging: f32) -> f32 {
        // Neither product overflows: the densities of tiny lights are huge.
        let share = self.kept_share(1.0 / (1.0 + (own + other) / merging));
        (1.0 - share) * own / (own + other)
    }

    fn kept_share(self, share: f32) -> f32 {
        // None where nothing finds the path at all, which is not a number.
        if share >= self.min_share { share } else { 0.0 }
    }
}
