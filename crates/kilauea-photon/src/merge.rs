//! Weights of caustic photons against other ways to make the same path.
//!
//! A caustic photon has gone from a light y₀ over near-specular surfaces y₁ … yₖ₋₁ to a rough one,
//! x = yₖ, and an eye path has x as its first rough vertex. Three strategies make that path:
//!
//! - *merging*: the photon lies within the radius around x. Its density is the eye's for x times
//!   η p_L, where η = N π r² for N emitted paths, and p_L is the density of the light path in area;
//! - *hitting*: from x the eye path goes on by sampling BSDFs until it meets the light;
//! - *connecting*: the same up to y₁, where the light is sampled (next-event estimation).
//!
//! The balance heuristic (Veach 1997, §9.2) needs ratios of these densities. In them the squared
//! distances cancel, since the two directions of an edge share them, and what remains is a product
//! over edges (j, j+1) of
//!
//! ```text
//! p(yⱼ₊₁ → yⱼ) cos θⱼ / (p(yⱼ → yⱼ₊₁) cos θⱼ₊₁)
//! ```
//!
//! with densities over solid angle and the cosines of the edge at its ends, divided by the density
//! of y₀. So one number, updated at each vertex, suffices on either side: it is what dVCM and dVM of
//! Georgiev (2012, "Implementing Vertex Connection and Merging") become when only these three
//! strategies compete. [`LightSubpath`] multiplies from the light to x, [`EyeSubpath`] from x to the
//! light.
//!
//! The weights of a path sum to one if both sides use one function for each density, with Russian
//! roulette within both or in neither. A perfectly specular vertex has the same discrete probability
//! in both directions; both densities are then passed as that, and nothing connects there.

/// What a light's photon path carries so that its caustic photons can be weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSubpath {
    d: f32,
}

impl LightSubpath {
    /// A path that leaves a light with the density `emission_pdf`: that of the point in 1/m² times
    /// that of the direction in 1/sr, for lights at infinity that of the direction times that of
    /// the point on the disc through which it enters. `cos_light` is the cosine at the light, 1 for
    /// lights at infinity. Both with the probability of choosing the light.
    #[must_use]
    pub fn emitted(emission_pdf: f32, cos_light: f32) -> Self {
        Self {
            d: cos_light / emission_pdf,
        }
    }

    /// The next surface is met at the (absolute) cosine `cos_in`.
    #[must_use]
    pub fn arrived(self, cos_in: f32) -> Self {
        Self { d: self.d / cos_in }
    }

    /// The path was scattered with the density `forward_pdf`, at the cosine `cos_out` to the next
    /// edge. `reverse_pdf` is the density of the direction back, if the path came from the other
    /// side: at the first surface after the light that of hitting the light by sampling the BSDF
    /// plus that of [connecting](self) to it, both over solid angle.
    #[must_use]
    pub fn scattered(self, forward_pdf: f32, reverse_pdf: f32, cos_out: f32) -> Self {
        Self {
            d: self.d * reverse_pdf * cos_out / forward_pdf,
        }
    }

    /// What a photon that is stored here carries: the sum of the densities of hitting and connecting
    /// over p_L, for one unit of the density with which the eye samples the direction back; m² sr.
    pub fn d_eye(self) -> f32 {
        self.d
    }
}

/// What an eye path carries from its first rough vertex over near-specular ones to a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeSubpath {
    /// p_L over the density of the eye path since the rough vertex.
    d: f32,
}

impl EyeSubpath {
    /// A path that leaves its first rough vertex in a direction with the density `pdf` over solid
    /// angle, at the cosine `cos_out`.
    #[must_use]
    pub fn left_rough(pdf: f32, cos_out: f32) -> Self {
        Self { d: cos_out / pdf }
    }

    /// The next surface is met at the (absolute) cosine `cos_in`.
    #[must_use]
    pub fn arrived(self, cos_in: f32) -> Self {
        Self { d: self.d / cos_in }
    }

    /// The path was scattered by a near-specular surface with the density `forward_pdf`, at the cosine
    /// `cos_out` to the next edge; `reverse_pdf` is the density with which light that comes along
    /// the next edge goes back along the last one.
    #[must_use]
    pub fn scattered(self, forward_pdf: f32, reverse_pdf: f32, cos_out: f32) -> Self {
        Self {
            d: self.d * reverse_pdf * cos_out / forward_pdf,
        }
    }

    /// The path ends at a light, where `cos_light` and `emission_pdf` are as for
    /// [`LightSubpath::emitted`]: p_L over the density of the eye path, in 1/m².
    pub fn d_light(self, emission_pdf: f32, cos_light: f32) -> f32 {
        self.d * emission_pdf / cos_light
    }
}

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
        let share = self.kept_share(merging / (own + other + merging));
        (1.0 - share) * own / (own + other)
    }

    fn kept_share(self, share: f32) -> f32 {
        if share < self.min_share { 0.0 } else { share }
    }
}
