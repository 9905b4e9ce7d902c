//! Chi² and directional albedo of a BSDF, and the numbers that drive them.

use std::f64::consts::PI;

use kilauea_bsdf::Bsdf;
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Spectrum, Vec3};

/// Independent uniform numbers.
pub fn uniforms(i: u32) -> [f32; 3] {
    std::array::from_fn(|k| unit_f32(combine(i, k as u32)))
}

/// A unit direction, uniform over the sphere.
pub fn direction(i: u32) -> Vec3 {
    let [u, v, _] = uniforms(i ^ 0x5555);
    kilauea_math::warp::uniform_sphere([u, v].into())
}

/// The point of an evenly spread sequence (Roberts 2018, "R3").
fn evenly(i: u32) -> [f32; 3] {
    [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|a: f64| (0.5 + a * f64::from(i)).fract() as f32)
}

/// What one sample scatters of a constant environment, per medium: refraction is freed of the
/// change of radiance between media.
fn scattered(bsdf: &Bsdf, wo: Vec3, u: [f32; 3]) -> Spectrum {
    bsdf.sample(wo, u)
        .map_or(Spectrum::BLACK, |s| s.weight() * s.eta_scale)
}

/// Directional albedo by sampling.
pub fn sampled_albedo(bsdf: &Bsdf, wo: Vec3, n: u32) -> Spectrum {
    (0..n)
        .map(|i| scattered(bsdf, wo, evenly(i)))
        .sum::<Spectrum>()
        / n as f32
}

/// How far sampled directions are from `pdf`, in standard deviations of chi².
///
/// Bins are cells of polar angle and azimuth; those that expect few samples are pooled. Samples
/// of delta lobes and lost samples belong to no bin.
pub fn chi2_deviation(bsdf: &Bsdf, wo: Vec3, n_samples: u32) -> f64 {
    const N: usize = 32;
    const N_SUB: usize = 20;
    let mut counts = vec![0.0; N * N];
    for i in 0..n_samples {
        let Some(s) = bsdf.sample(wo, uniforms(i)) else {
            continue;
        };
        if !s.is_delta {
            let theta = f64::from(s.wi.z.clamp(-1.0, 1.0)).acos();
            let phi = f64::from(s.wi.y).atan2(f64::from(s.wi.x)) + PI;
            let row = ((theta / PI * N as f64) as usize).min(N - 1);
            let column = ((phi / (2.0 * PI) * N as f64) as usize).min(N - 1);
            counts[row * N + column] += 1.0;
        }
    }
    let expected = |row: usize, column: usize| {
        let (d_theta, d_phi) = (PI / (N * N_SUB) as f64, 2.0 * PI / (N * N_SUB) as f64);
        let mut sum = 0.0;
        for i in 0..N_SUB {
            let theta = ((row * N_SUB + i) as f64 + 0.5) * d_theta;
            let (sin, cos) = theta.sin_cos();
            for j in 0..N_SUB {
                let phi = ((column * N_SUB + j) as f64 + 0.5) * d_phi - PI;
                let wi = Vec3::new(
                    (sin * phi.cos()) as f32,
                    (sin * phi.sin()) as f32,
                    cos as f32,
                );
                sum += f64::from(bsdf.eval(wo, wi).pdf) * sin;
            }
        }
        sum * d_theta * d_phi * f64::from(n_samples)
    };

    let (mut chi2, mut n_bins) = (0.0, 0.0);
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
    ((chi2 / n_bins as f64).cbrt() - (1.0 - v)) / f64::sqrt(v)
}
