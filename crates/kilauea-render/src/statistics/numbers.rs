//! The numbers of different purposes and bounces, which must not know of each other.

use kilauea_math::Vec2;
use kilauea_testing::{Draw, Family, Rectangle, compare};

use crate::sampler::{Purpose, Sampler, SamplerTables};

const WIDTH: u32 = 160;

/// p-value of one point per sample, over a picture, against the even density of the square.
fn p_value(samples_per_pixel: u32, seed: u32, point: impl Fn(&Sampler<'_>) -> Vec2) -> f64 {
    let tables = SamplerTables::new(samples_per_pixel, 8, seed);
    let domain = Rectangle {
        min: Vec2::ZERO,
        max: Vec2::ONE,
    };
    let n_pixels = WIDTH * WIDTH / samples_per_pixel;
    let draw = |i: u32| {
        let (pixel, sample) = (i / samples_per_pixel, i % samples_per_pixel);
        let sequence = tables.pixel([(pixel % WIDTH) as i32, (pixel / WIDTH) as i32]);
        Draw::At(point(&sequence.sampler(sample)))
    };
    compare(&domain, n_pixels * samples_per_pixel, draw, |_| 1.0).p_value()
}

const PURPOSES: [Purpose; 7] = [
    Purpose::Filter,
    Purpose::Lens,
    Purpose::Time,
    Purpose::Light(0),
    Purpose::Direction(0),
    Purpose::Choice(0),
    Purpose::Direction(1),
];

#[test]
fn numbers_of_two_purposes_are_independent() {
    let mut family = Family::new("pairs of purposes");
    for (seed, samples_per_pixel) in [(0, 1), (1, 4), (2, 16)] {
        for (i, a) in PURPOSES.into_iter().enumerate() {
            for &b in &PURPOSES[..i] {
                let point = |s: &Sampler<'_>| Vec2::new(s.pair(a).x, s.pair(b).x);
                let p = p_value(samples_per_pixel, seed, point);
                family.add(format!("{a:?} and {b:?}, {samples_per_pixel} samples"), p);
            }
        }
    }
    family.check();
}

#[test]
fn numbers_of_one_purpose_fill_the_square() {
    let mut family = Family::new("purposes");
    for purpose in PURPOSES {
        let p = p_value(4, 5, |s| s.pair(purpose));
        family.add(format!("{purpose:?}"), p);
    }
    family.check();
}

#[test]
fn numbers_that_serve_twice_are_found() {
    let twice = |s: &Sampler<'_>| Vec2::new(s.pair(Purpose::Lens).x, s.pair(Purpose::Lens).x);
    assert!(p_value(4, 0, twice) < 1e-6);
}
