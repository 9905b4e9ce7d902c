//! Pixel filters: where samples fall, against the formulas of the filters.

#![forbid(unsafe_code)]

use kilauea_film::Filter;
use kilauea_math::Vec2;
use kilauea_scene::FilterKind;
use kilauea_testing::{Draw, Family, Rectangle, compare, uniforms};
use std::f64::consts::PI;

const N_DRAWS: u32 = 60_000;
const KINDS: [FilterKind; 3] = [
    FilterKind::Box,
    FilterKind::Gaussian,
    FilterKind::BlackmanHarris,
];

/// Density of a filter along one axis, at a distance from its center in radii.
fn density_of_radii(kind: FilterKind, x: f64) -> f64 {
    match kind {
        FilterKind::Box => 0.5,
        FilterKind::Gaussian => {
            // √(2π) erf(3 / √2) / 3 is the integral of the first term, 2 exp(−4.5) of the second.
            let (sigma, rim) = (1.0 / 3.0, (-4.5_f64).exp());
            let area = sigma * (2.0 * PI).sqrt() * 0.997_300_203_936_74 - 2.0 * rim;
            ((-0.5 * (x / sigma).powi(2)).exp() - rim) / area
        }
        FilterKind::BlackmanHarris => {
            // All cosines have mean zero over the window.
            let terms = [0.35875, 0.48829, 0.14128, 0.01168];
            let cosine = |k: usize| (k as f64 * PI * x).cos();
            let sum: f64 = terms.iter().enumerate().map(|(k, a)| a * cosine(k)).sum();
            sum / (2.0 * terms[0])
        }
    }
}

/// p-value of samples of a filter against the density of one with another radius.
fn p_value(kind: FilterKind, radius: f32, stated_radius: f32) -> f64 {
    let filter = Filter::new(kind, Some(radius));
    let domain = Rectangle {
        min: Vec2::splat(-radius),
        max: Vec2::splat(radius),
    };
    let draw = |i| Draw::At(filter.sample(Vec2::from_array(uniforms(kind as u32, i))));
    let density = |p: Vec2| {
        let along = |x: f32| {
            let x = f64::from(x.abs() / stated_radius);
            if x <= 1.0 {
                density_of_radii(kind, x) / f64::from(stated_radius)
            } else {
                0.0
            }
        };
        along(p.x) * along(p.y)
    };
    compare(&domain, N_DRAWS, draw, density).p_value()
}

#[test]
fn samples_are_distributed_as_the_filter() {
    let mut family = Family::new("filters");
    for kind in KINDS {
        for radius in [0.5, 1.5, 3.0] {
            let p = p_value(kind, radius, radius);
            family.add(format!("{kind:?} of radius {radius}"), p);
        }
    }
    family.check();
}

#[test]
fn a_radius_off_by_five_percent_is_noticed() {
    for kind in KINDS {
        for stated in [1.425, 1.575] {
            let p = p_value(kind, 1.5, stated);
            assert!(p < 1e-6, "{kind:?}: {p}");
        }
    }
}
