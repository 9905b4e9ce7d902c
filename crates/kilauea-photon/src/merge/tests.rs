//! Weights against the balance heuristic on densities with all their factors.

use super::{EyeSubpath, LightSubpath, Merging};
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
        let from_light = edges().map(|j| self.from_light[j] * self.cos_near_eye[j] / self.d_sq[j]);
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

    /// Weights of merging, and of hitting and connecting together.
    fn weights(&self, merging: Merging) -> [f32; 2] {
        let pdf_at_rough = self.from_eye[self.n_edges() - 1] as f32;
        [
            merging.weight_of_photon(self.d_eye(), pdf_at_rough),
            merging.weight_of_eye(self.d_light(self.from_eye[0] + self.connect)),
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
            let eta =
                f64::from(n_emitted as u32) * std::f64::consts::PI * f64::from(radius).powi(2);
            let densities = [eta * photon, hit + connect];
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

#[test]
fn photons_that_nothing_is_left_to_have_no_weight_where_no_path_goes_either() {
    assert_eq!(Merging::never().weight_of_photon(3.0, 0.0), 0.0);
}
