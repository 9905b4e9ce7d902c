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

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_testing::uniforms;

    /// A path y₀ … yₖ and what each strategy would make of it.
    struct Path {
        /// Squared lengths of the edges (j, j+1).
        d_sq: Vec<f64>,
        /// Cosines of the edges at yⱼ.
        cos_near_light: Vec<f64>,
        /// Cosines of the edges at yⱼ₊₁.
        cos_near_eye: Vec<f64>,
        /// Density of the light, per area.
        emit_point: f64,
        /// Density of yⱼ → yⱼ₊₁ over solid angle, from the light's side.
        from_light: Vec<f64>,
        /// Density of yⱼ₊₁ → yⱼ over solid angle, from the eye's side.
        from_eye: Vec<f64>,
        /// Density of y₁ → y₀ over solid angle by connecting.
        connect: f64,
    }

    impl Path {
        /// With `n_edges` >= 2 and, where `n_specular` says so, perfectly specular vertices first.
        fn random(i: u32, n_edges: usize, n_specular: usize, is_infinite: bool) -> Self {
            let numbers = |stream: u32, low: f64, high: f64| -> Vec<f64> {
                let between = |u: &f32| low * (high / low).powf(f64::from(*u));
                uniforms::<5>(stream, i)
                    .iter()
                    .take(n_edges)
                    .map(between)
                    .collect()
            };
            let mut path = Self {
                d_sq: numbers(1, 1e-3, 1e3),
                cos_near_light: numbers(2, 0.01, 1.0),
                cos_near_eye: numbers(3, 0.01, 1.0),
                emit_point: numbers(4, 1e-3, 1e3)[0],
                from_light: numbers(5, 1e-2, 1e4),
                from_eye: numbers(6, 1e-2, 1e4),
                connect: numbers(7, 1e-2, 1e4)[0],
            };
            for vertex in 1..=n_specular {
                // y_vertex scatters light to edge `vertex` and eye paths to the edge before.
                path.from_light[vertex] = 0.5;
                path.from_eye[vertex - 1] = 0.5;
            }
            if n_specular > 0 {
                path.connect = 0.0;
            }
            if is_infinite {
                // The density of y₁ is that of the disc, and of y₀ that of a direction.
                (path.d_sq[0], path.cos_near_light[0]) = (1.0, 1.0);
            }
            path
        }

        fn n_edges(&self) -> usize {
            self.d_sq.len()
        }

        /// Densities over area of merging (for η = 1), hitting and connecting, without what the eye
        /// path to yₖ has in common.
        fn densities(&self) -> [f64; 3] {
            let edges = || 0..self.n_edges();
            let from_light =
                edges().map(|j| self.from_light[j] * self.cos_near_eye[j] / self.d_sq[j]);
            let from_eye = |j: usize| self.from_eye[j] * self.cos_near_light[j] / self.d_sq[j];
            let hit: f64 = edges().map(from_eye).product();
            let connect = hit / self.from_eye[0] * self.connect;
            [self.emit_point * from_light.product::<f64>(), hit, connect]
        }

        fn emission_pdf(&self) -> f32 {
            (self.emit_point * self.from_light[0]) as f32
        }

        /// What a photon at yₖ carries.
        fn d_eye(&self) -> f32 {
            let emitted = LightSubpath::emitted(self.emission_pdf(), self.cos_near_light[0] as f32);
            let path = (1..self.n_edges()).fold(emitted, |path, j| {
                let connect = if j == 1 { self.connect } else { 0.0 };
                path.arrived(self.cos_near_eye[j - 1] as f32).scattered(
                    self.from_light[j] as f32,
                    (self.from_eye[j - 1] + connect) as f32,
                    self.cos_near_light[j] as f32,
                )
            });
            path.arrived(self.cos_near_eye[self.n_edges() - 1] as f32)
                .d_eye()
        }

        /// What an eye path carries at y₀ if its last density is `last`.
        fn d_light(&self, last: f64) -> f32 {
            let density = |j: usize| if j == 0 { last } else { self.from_eye[j] };
            let top = self.n_edges() - 1;
            let left = EyeSubpath::left_rough(density(top) as f32, self.cos_near_eye[top] as f32);
            let path = (1..=top).rev().fold(left, |path, j| {
                path.arrived(self.cos_near_light[j] as f32).scattered(
                    density(j - 1) as f32,
                    self.from_light[j] as f32,
                    self.cos_near_eye[j - 1] as f32,
                )
            });
            path.d_light(self.emission_pdf(), self.cos_near_light[0] as f32)
        }

        /// Weights of merging, hitting and connecting.
        fn weights(&self, merging: Merging) -> [f32; 3] {
            let pdf_at_rough = self.from_eye[self.n_edges() - 1] as f32;
            let (pdf, connect_pdf) = (self.from_eye[0], self.connect);
            let connection = if connect_pdf > 0.0 {
                let d_light = self.d_light(connect_pdf);
                merging.weight_of_connection(d_light, pdf as f32, connect_pdf as f32)
            } else {
                0.0
            };
            [
                merging.weight_of_photon(self.d_eye(), pdf_at_rough),
                merging.weight_of_hit(self.d_light(pdf), pdf as f32, connect_pdf as f32),
                connection,
            ]
        }
    }

    fn paths() -> impl Iterator<Item = Path> {
        (0..2000).map(|i| {
            let n_edges = 2 + (i % 4) as usize;
            Path::random(i, n_edges, (i / 4 % 3) as usize % n_edges, i % 5 == 0)
        })
    }

    const ETAS: [(u64, f32); 3] = [(1, 1e-3), (1000, 0.01), (1_000_000, 0.1)];

    #[test]
    fn weights_are_those_of_the_balance_heuristic() {
        for path in paths() {
            for (n_emitted, radius) in ETAS {
                let merging = Merging::new(n_emitted, radius, 0.0);
                let [photon, hit, connect] = path.densities();
                let densities = [f64::from(merging.eta) * photon, hit, connect];
                let sum: f64 = densities.iter().sum();
                for (weight, density) in path.weights(merging).into_iter().zip(densities) {
                    assert!((f64::from(weight) - density / sum).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn weights_sum_to_one_with_any_least_share() {
        let mut n_left_to_others = 0;
        for path in paths() {
            for (n_emitted, radius) in ETAS {
                for min_share in [0.0, 0.1, 0.5, 1.1] {
                    let weights = path.weights(Merging::new(n_emitted, radius, min_share));
                    let sum: f32 = weights.iter().sum();
                    assert!((sum - 1.0).abs() < 1e-4, "{weights:?}");
                    n_left_to_others += u32::from(weights[0] == 0.0);
                }
            }
        }
        assert!(n_left_to_others > 1000, "{n_left_to_others}");
    }

    #[test]
    fn photons_that_nothing_else_makes_keep_all_their_weight() {
        let merging = Merging::new(1000, 0.1, 0.1);
        assert_eq!(merging.weight_of_photon(0.0, 3.0), 1.0);
    }
}
