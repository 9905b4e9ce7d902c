//! The harness holds what is sound and rejects what is not: faults are planted in draws from a
//! known density, and must be found.

#![forbid(unsafe_code)]

use kilauea_math::{Vec2, Vec3, warp};
use kilauea_testing::{
    Chi2, Comparison, Directions, Draw, Family, Moments, Rectangle, compare, uniforms, welch_p,
};

const N_DRAWS: u32 = 20_000;

fn square(stream: u32, i: u32) -> Vec2 {
    Vec2::from_array(uniforms(stream, i))
}

/// Draws cosine-distributed directions from numbers that `change` has altered.
fn cosine(stream: u32, change: impl Fn(u32, Vec2) -> Vec2, density: impl Fn(Vec3) -> f64) -> f64 {
    let draw = |i| Draw::At(warp::cosine_hemisphere(change(i, square(stream, i))));
    compare(&Directions::around(Vec3::Z, 1.5), N_DRAWS, draw, density).p_value()
}

fn cosine_pdf(w: Vec3) -> f64 {
    f64::from(warp::cosine_hemisphere_pdf(w.z))
}

#[test]
fn sound_draws_have_even_p_values() {
    const N: u32 = 200;
    let mut tenths = [(0.0, f64::from(N) / 10.0); 10];
    let mut family = Family::new("sound draws");
    for stream in 0..N {
        let draw = |i| Draw::At(square(stream, i));
        let domain = Rectangle {
            min: Vec2::ZERO,
            max: Vec2::ONE,
        };
        let p = compare(&domain, N_DRAWS, draw, |_| 1.0).chi2.p_value();
        tenths[((10.0 * p) as usize).min(9)].0 += 1.0;
        family.add(format!("stream {stream}"), p);
    }
    family.check();
    let evenness = Chi2::test(&tenths).p_value();
    assert!(evenness > 1e-3, "{tenths:?}: {evenness}");
}

#[test]
fn a_density_off_by_a_factor_is_found() {
    let off = |factor: f64| cosine(1, |_, u| u, |w| factor * cosine_pdf(w));
    assert!(off(1.0) > 0.01);
    for factor in [0.98, 0.995, 1.005, 1.02] {
        assert!(off(factor) < 1e-6, "{factor}: {}", off(factor));
    }
}

#[test]
fn a_cosine_left_out_is_found() {
    let uniform = |w: Vec3| {
        if w.z > 0.0 {
            0.5 / std::f64::consts::PI
        } else {
            0.0
        }
    };
    assert!(cosine(2, |_, u| u, uniform) < 1e-6);
}

#[test]
fn numbers_that_repeat_are_found() {
    // Counts in pairs vary twice as much.
    let repeated = |i: u32, _| square(3, i / 2);
    assert!(cosine(3, repeated, cosine_pdf) < 1e-6);
}

#[test]
fn a_corner_never_reached_is_found() {
    // Two percent of each side.
    let short = |_, u: Vec2| {
        if u.min_element() > 0.98 { u - 0.98 } else { u }
    };
    let missing_edge = |_, u: Vec2| Vec2::new(0.98 * u.x, u.y);
    assert!(cosine(4, |_, u| u, cosine_pdf) > 0.01);
    assert!(cosine(4, missing_edge, cosine_pdf) < 1e-6);
    // A corner holds 0.04 % of all draws, 8 of them: less than chance moves.
    assert!(cosine(4, short, cosine_pdf) > 1e-3);
    let large = |_, u: Vec2| {
        if u.min_element() > 0.9 { u - 0.9 } else { u }
    };
    assert!(cosine(4, large, cosine_pdf) < 1e-6);
}

/// Half of the draws are uniform, a fifth go to an atom, the others are lost.
fn mixture(stated_probability: f64, stated_density: f64) -> Comparison {
    let domain = Rectangle {
        min: Vec2::ZERO,
        max: Vec2::ONE,
    };
    let draw = |i| {
        let [choice, x, y] = uniforms(5, i);
        match choice {
            0.0..0.5 => Draw::At(Vec2::new(x, y)),
            0.5..0.7 => Draw::Atom {
                idx: 0,
                probability: stated_probability,
            },
            _ => Draw::Lost,
        }
    };
    compare(&domain, N_DRAWS, draw, |_| stated_density)
}

#[test]
fn atoms_and_lost_draws_count() {
    let sound = mixture(0.2, 0.5);
    assert!(sound.p_value() > 0.01, "{sound:?}");
    assert!((sound.mass - 0.7).abs() < 1e-9);
    assert!(mixture(0.23, 0.5).p_value() < 1e-6);
    assert!(mixture(0.2, 0.53).p_value() < 1e-6);
    assert!(mixture(0.2, 0.9).p_value() < 1e-6);
}

#[test]
fn tests_of_means_are_even_and_find_a_shift() {
    const N: u32 = 400;
    let mut of_student = [(0.0, f64::from(N) / 10.0); 10];
    let mut of_welch = of_student;
    let mut n_shifts_found = 0;
    for stream in 0..N {
        // Sums of twelve are nearly normal, with variance one.
        let normal = |i| {
            uniforms::<12>(stream, i)
                .into_iter()
                .map(f64::from)
                .sum::<f64>()
                - 6.0
        };
        let a = Moments::of(&(0..16).map(normal).collect::<Vec<_>>());
        let b = Moments::of(&(16..24).map(|i| 3.0 * normal(i)).collect::<Vec<_>>());
        let tenth = |p: f64| ((10.0 * p) as usize).min(9);
        of_student[tenth(a.p_value(0.0, 0.0))].0 += 1.0;
        of_welch[tenth(welch_p(&a, &b, 0.0))].0 += 1.0;
        n_shifts_found += u32::from(a.p_value(2.0, 0.0) < 1e-3);
    }
    for tenths in [of_student, of_welch] {
        assert!(Chi2::test(&tenths).p_value() > 1e-3, "{tenths:?}");
    }
    assert!(n_shifts_found > N * 9 / 10, "{n_shifts_found}");
}
