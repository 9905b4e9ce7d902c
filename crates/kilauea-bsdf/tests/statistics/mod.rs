//! Chi² and directional albedo of a BSDF, and the numbers that drive them.

use std::f64::consts::PI;

use kilauea_bsdf::Bsdf;
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Spectrum, Vec3};

/// Independent uniform numbers.
pub(crate) fn uniforms(i: u32) -> [f32; 3] {
    std::array::from_fn(|k| unit_f32(combine(i, k as u32)))
}

/// A unit direction, uniform over the sphere.
pub(crate) fn direction(i: u32) -> Vec3 {
    let [u, v, _] = uniforms(i ^ 0x5555);
    kilauea_math::warp::uniform_sphere([u, v].into())
}

/// The point of an evenly spread sequence (Roberts 2018, "R3").
fn evenly(i: u32) -> [f32; 3] {
    [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|a: f64| (0.5 + a * f64::from(i)).fract() as f32)
}

/// What one sample scatters of a constant environment.
fn scattered(bsdf: &Bsdf, wo: Vec3, u: [f32; 3]) -> Spectrum {
    bsdf.sample(wo, u).map_or(Spectrum::BLACK, |s| s.weight())
}

/// Directional albedo by sampling.
pub(crate) fn sampled_albedo(bsdf: &Bsdf, wo: Vec3, n: u32) -> Spectrum {
    (0..n)
        .map(|i| scattered(bsdf, wo, evenly(i)))
        .sum::<Spectrum>()
        / n as f32
}

/// Bins per half turn of the polar angle and per turn of the azimuth.
const N_BINS: usize = 24;

fn direction_at(theta: f64, phi: f64) -> Vec3 {
    let ((sin_theta, cos_theta), (sin_phi, cos_phi)) = (theta.sin_cos(), phi.sin_cos());
    Vec3::new(
        (sin_theta * cos_phi) as f32,
        (sin_theta * sin_phi) as f32,
        cos_theta as f32,
    )
}

/// The integral of the density over a cell of polar angle and azimuth: midpoint rule, halved
/// wherever a finer one disagrees.
fn integrate_pdf(
    bsdf: &Bsdf,
    wo: Vec3,
    [theta, phi]: [f64; 2],
    [d_theta, d_phi]: [f64; 2],
    depth: u32,
) -> f64 {
    let midpoint = |n: u32| {
        let (step_theta, step_phi) = (d_theta / f64::from(n), d_phi / f64::from(n));
        let mut sum = 0.0;
        for i in 0..n {
            let theta = theta + (f64::from(i) + 0.5) * step_theta;
            for j in 0..n {
                let wi = direction_at(theta, phi + (f64::from(j) + 0.5) * step_phi);
                sum += f64::from(bsdf.eval(wo, wi).pdf) * theta.sin();
            }
        }
        sum * step_theta * step_phi
    };
    let (coarse, fine) = (midpoint(3), midpoint(6));
    if depth == 0 || (depth < 7 && (coarse - fine).abs() < 1e-3 * fine + 1e-6) {
        return fine;
    }
    let half = [0.5 * d_theta, 0.5 * d_phi];
    let corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
    corners
        .map(|(i, j)| {
            let corner = [theta + i * half[0], phi + j * half[1]];
            integrate_pdf(bsdf, wo, corner, half, depth - 1)
        })
        .iter()
        .sum()
}

/// How far directions that `sampled` draws are from the density that `stated` gives, in standard
/// deviations of chi².
///
/// Bins are cells of polar angle and azimuth; those that expect few samples are pooled. Samples
/// of delta lobes and lost samples belong to no bin.
pub(crate) fn chi2_deviation(sampled: &Bsdf, stated: &Bsdf, wo: Vec3, n_samples: u32) -> f64 {
    const N: usize = N_BINS;
    let cell = [PI / N as f64, 2.0 * PI / N as f64];
    let mut counts = vec![0.0; N * N];
    for s in (0..n_samples).filter_map(|i| sampled.sample(wo, uniforms(i))) {
        if !s.is_delta {
            let theta = f64::from(s.wi.z.clamp(-1.0, 1.0)).acos();
            let phi = f64::from(s.wi.y).atan2(f64::from(s.wi.x)) + PI;
            let row = ((theta / cell[0]) as usize).min(N - 1);
            let column = ((phi / cell[1]) as usize).min(N - 1);
            counts[row * N + column] += 1.0;
        }
    }
    let expected = |row: usize, column: usize| {
        let corner = [row as f64 * cell[0], column as f64 * cell[1] - PI];
        integrate_pdf(stated, wo, corner, cell, 8) * f64::from(n_samples)
    };

    let (mut chi2, mut n_bins) = (0.0_f64, 0.0_f64);
    let (mut pooled_count, mut pooled_expected) = (0.0, 0.0);
    for row in 0..N {
        for column in 0..N {
            let (count, expected) = (counts[row * N + column], expected(row, column));
            if expected < 10.0 {
                pooled_count += count;
                pooled_expected += expected;
            } else {
                chi2 += (count - expected).powi(2) / expected;
                n_bins += 1.0;
            }
        }
    }
    if pooled_expected > 10.0 {
        chi2 += (pooled_count - pooled_expected).powi(2) / pooled_expected;
        n_bins += 1.0;
    } else {
        // Samples where none may be.
        chi2 += (pooled_count - pooled_expected).powi(2) / 10.0;
    }
    // Wilson & Hilferty 1931: the cube root of chi² per degree of freedom is nearly normal.
    let v = 2.0 / (9.0 * n_bins);
    ((chi2 / n_bins).cbrt() - (1.0 - v)) / f64::sqrt(v)
}
