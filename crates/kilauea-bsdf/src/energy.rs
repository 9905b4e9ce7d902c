//! How much the GGX lobe reflects in all directions together, tabulated.

use kilauea_math::Spectrum;

use crate::energy_table::ROWS;
use crate::fresnel::schlick_weight;
use crate::ggx::MIN_ALPHA;

/// Directional albedo of the GGX lobe with Schlick's Fresnel: `f0 · base + f90 · edge` (the split
/// sum of Karis 2013).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SplitSum {
    pub(crate) base: f32,
    pub(crate) edge: f32,
}

impl SplitSum {
    /// Directional albedo of facets that reflect everything; what is missing to 1 is light that
    /// would meet a second facet.
    #[inline]
    pub(crate) fn white(self) -> f32 {
        self.base + self.edge
    }

    /// Factor that gives back the light of further facets (Turquin 2019): 1 / [`Self::white`] for
    /// white metals, nearly 1 for dielectrics, and never more than white in total.
    #[inline]
    pub(crate) fn compensation(self, f0: Spectrum) -> Spectrum {
        let missing = (1.0 / self.white() - 1.0).max(0.0);
        Spectrum::ONE + f0 * missing
    }

    /// Directional albedo including compensation.
    #[inline]
    pub(crate) fn albedo(self, f0: Spectrum, f90: Spectrum) -> Spectrum {
        (f0 * self.base + f90 * self.edge) * self.compensation(f0)
    }
}

pub(crate) const N_COS: usize = 64;
pub(crate) const N_ROUGHNESS: usize = 32;

/// Roughness at the first row.
const MIN_ROUGHNESS: f32 = 0.0316;

/// What one alpha reflects, by [`abscissa`].
#[derive(Debug)]
pub(crate) struct Row {
    /// [`SplitSum::white`], and what [`Self::grazing`] leaves of [`SplitSum::edge`].
    pub(crate) by_cos: [[f32; 2]; N_COS],
    /// Share of Schlick's weight taken out of the edge, so that what is left is smooth.
    pub(crate) grazing: f32,
    /// Cosine-weighted means of base, edge, and both times the compensation's (1/white − 1).
    pub(crate) means: [f32; 4],
}

/// Where a row has a cosine, in [0, 1]: one half resolves the dip that lobes have at cosines below
/// their alpha, the other Fresnel's rise.
#[inline]
fn abscissa(alpha: f32, cos: f32) -> f32 {
    0.5 * (cos * (1.0 + alpha) / (cos + alpha) + cos.sqrt())
}

impl Row {
    #[inline]
    fn at(&self, x: f32, schlick: f32) -> SplitSum {
        let x = x * (N_COS - 1) as f32;
        let i = (x as usize).min(N_COS - 2);
        let t = x - i as f32;
        let [white, edge] =
            std::array::from_fn(|k| lerp(self.by_cos[i][k], self.by_cos[i + 1][k], t));
        let edge = edge + self.grazing * schlick;
        SplitSum {
            base: white - edge,
            edge,
        }
    }
}

#[inline]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + t * (b - a)
}

/// The two rows around an alpha and the weight of the second.
#[inline]
fn rows(alpha: f32) -> (&'static Row, &'static Row, f32) {
    let y = (alpha.sqrt() - MIN_ROUGHNESS) / (1.0 - MIN_ROUGHNESS);
    let y = y.clamp(0.0, 1.0) * (N_ROUGHNESS - 1) as f32;
    let i = (y as usize).min(N_ROUGHNESS - 2);
    (&ROWS[i], &ROWS[i + 1], y - i as f32)
}

/// Directional albedo of the lobe at a cosine in [0, 1]; exact for delta lobes.
#[inline]
pub(crate) fn split_sum(alpha: f32, cos: f32) -> SplitSum {
    let schlick = schlick_weight(cos);
    if alpha < MIN_ALPHA {
        return SplitSum {
            base: 1.0 - schlick,
            edge: schlick,
        };
    }
    let (low, high, t) = rows(alpha);
    let x = abscissa(alpha, cos);
    let (a, b) = (low.at(x, schlick), high.at(x, schlick));
    SplitSum {
        base: lerp(a.base, b.base, t),
        edge: lerp(a.edge, b.edge, t),
    }
}

/// Cosine-weighted mean of [`SplitSum::albedo`] over the hemisphere.
#[inline]
pub(crate) fn mean_albedo(alpha: f32, f0: Spectrum, f90: Spectrum) -> Spectrum {
    const EDGE: f32 = 1.0 / 21.0;
    if alpha < MIN_ALPHA {
        return f0 * (1.0 - EDGE) + f90 * EDGE;
    }
    let (low, high, t) = rows(alpha);
    let [base, edge, base_missing, edge_missing] =
        std::array::from_fn(|i| lerp(low.means[i], high.means[i], t));
    f0 * base + f90 * edge + f0 * (f0 * base_missing + f90 * edge_missing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ggx::{Ggx, Half};
    use kilauea_math::{Vec2, Vec3};

    /// Stands for grazing.
    const MIN_COS: f32 = 1.0e-4;

    /// Midpoint rule over `n` by `4 n` of the samples that [`Ggx::sample`] would draw.
    fn integrate(alpha: f32, cos: f32, n: usize) -> SplitSum {
        let ggx = Ggx::new(alpha, cos);
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let (mut base, mut edge) = (0.0_f64, 0.0_f64);
        for j in 0..4 * n {
            for i in 0..n {
                // Half a turn: the other half mirrors it.
                let u = Vec2::new(
                    (i as f32 + 0.5) / (2 * n) as f32,
                    (j as f32 + 0.5) / (4 * n) as f32,
                );
                let wi = ggx.sample(wo, u);
                if wi.z > 0.0 {
                    let half = Half::between(Vec3::Z, wo, wi).unwrap();
                    let facets = ggx.eval(&half, wi.z);
                    let weight = f64::from(facets.f_cos / facets.pdf);
                    let w = f64::from(schlick_weight(half.cos_d));
                    base += weight * (1.0 - w);
                    edge += weight * w;
                }
            }
        }
        let n = (4 * n * n) as f64;
        SplitSum {
            base: (base / n) as f32,
            edge: (edge / n) as f32,
        }
    }

    /// The cosine at an abscissa, by bisection.
    fn cos_at(alpha: f32, x: f32) -> f32 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if abscissa(alpha, middle) < x {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    fn alpha_of_row(i: usize) -> f32 {
        let t = i as f32 / (N_ROUGHNESS - 1) as f32;
        (MIN_ROUGHNESS + t * (1.0 - MIN_ROUGHNESS)).powi(2)
    }

    fn tabulate(alpha: f32) -> Row {
        const N: usize = 512;
        let grazing = integrate(alpha, MIN_COS, 128).edge;
        let by_cos = std::array::from_fn(|i| {
            let cos = cos_at(alpha, i as f32 / (N_COS - 1) as f32);
            let sum = integrate(alpha, cos.clamp(MIN_COS, 1.0), 128);
            [sum.white(), sum.edge - grazing * schlick_weight(cos)]
        });
        let mut row = Row {
            by_cos,
            grazing,
            means: [0.0; 4],
        };
        for i in 0..N {
            let cos = (i as f32 + 0.5) / N as f32;
            let sum = row.at(abscissa(alpha, cos), schlick_weight(cos));
            let missing = (1.0 / sum.white() - 1.0).max(0.0);
            let values = [sum.base, sum.edge, sum.base * missing, sum.edge * missing];
            for (mean, value) in row.means.iter_mut().zip(values) {
                *mean += value * 2.0 * cos / N as f32;
            }
        }
        row
    }

    #[test]
    #[ignore = "writes energy_table.rs anew"]
    fn write_table() {
        use std::fmt::Write;
        let mut text = String::from(
            "//! Made by `cargo test -p kilauea-bsdf write_table -- --ignored`.\n\n\
             use crate::energy::{N_ROUGHNESS, Row};\n\n\
             /// By roughness.\n#[rustfmt::skip]\npub(crate) static ROWS: [Row; N_ROUGHNESS] = [\n",
        );
        for i in 0..N_ROUGHNESS {
            let row = tabulate(alpha_of_row(i));
            let means = row.means.map(|v| format!("{v:.6}")).join(", ");
            writeln!(text, "    Row {{\n        grazing: {:.5},", row.grazing).unwrap();
            writeln!(text, "        means: [{means}],\n        by_cos: [").unwrap();
            for pairs in row.by_cos.chunks(4) {
                let pairs: Vec<_> = pairs
                    .iter()
                    .map(|[white, edge]| format!("[{white:.5}, {edge:.5}]"))
                    .collect();
                writeln!(text, "            {},", pairs.join(", ")).unwrap();
            }
            text += "        ],\n    },\n";
        }
        text += "];\n";
        std::fs::write("src/energy_table.rs", text).unwrap();
    }

    #[test]
    fn interpolation_is_close_to_the_integral() {
        for i in 0..12 {
            let roughness = 0.032 + 0.968 * (i as f32 / 11.0);
            let alpha = roughness * roughness;
            for j in 1..=16 {
                let cos = (j as f32 / 16.0_f32).powi(2);
                let (exact, found) = (integrate(alpha, cos, 64), split_sum(alpha, cos));
                let white = (exact.white() - found.white()).abs();
                let edge = (exact.edge - found.edge).abs();
                assert!(
                    white < 1e-3 && edge < 2e-3,
                    "{roughness} {cos}: {found:?} for {exact:?}"
                );
            }
        }
    }

    #[test]
    fn mean_is_the_mean_of_directional_albedos() {
        const N: usize = 400;
        let (f0, f90) = (Spectrum::new(0.04, 0.5, 1.0), Spectrum::ONE);
        for roughness in [0.0_f32, 0.1, 0.33, 0.7, 1.0] {
            let alpha = roughness * roughness;
            let mean: Spectrum = (0..N)
                .map(|i| {
                    let cos = (i as f32 + 0.5) / N as f32;
                    split_sum(alpha, cos).albedo(f0, f90) * (2.0 * cos / N as f32)
                })
                .sum();
            let found = mean_albedo(alpha, f0, f90);
            for c in 0..3 {
                assert!((mean[c] - found[c]).abs() < 1e-3, "{roughness}: {found:?}");
            }
        }
    }
}
