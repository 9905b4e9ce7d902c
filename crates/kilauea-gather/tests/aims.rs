//! Aims: from where light was found near a place, and around it.

#![forbid(unsafe_code)]

use kilauea_gather::{AimField, Arrival, Directions, GatherRecord};
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Vec2, Vec3};

/// Two patches of a floor, a unit wide, ten units apart; light comes from +x on the first and from
/// −x on the second, within half a degree.
fn patches(n: u32) -> Vec<GatherRecord> {
    let number = |i, what| unit_f32(combine(i, what));
    (0..n)
        .map(|i| {
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let spread = 0.008 * (number(i, 3) - 0.5);
            GatherRecord {
                p: Vec3::new(5.0 * side + number(i, 1), 0.0, number(i, 2)),
                n: Vec3::Y,
                arrival: Arrival {
                    wi: Vec3::new(side, 1.0, 0.3 + spread).normalize(),
                    irradiance: 1.0,
                    pdf: 1.0,
                },
                pixel: [0; 2],
                brought: 0.0,
            }
        })
        .collect()
}

#[test]
fn a_patch_aims_at_its_light_and_at_no_other() {
    let field = AimField::fit(&patches(4000)).expect("there are records");
    for side in [1.0, -1.0] {
        let p = Vec3::new(5.0 * side + 0.5, 0.0, 0.5);
        let directions = field.directions(p, Vec3::Y);
        assert!(directions.near.is_some());
        let [toward, away] = [1.0, -1.0].map(|x| Vec3::new(x * side, 1.0, 0.3).normalize());
        // By cosine it would be 0.23.
        assert!(directions.pdf(toward) > 100.0, "{}", directions.pdf(toward));
        assert!(directions.pdf(away) < 1.0, "{}", directions.pdf(away));
    }
}

/// No patch is near, but one is on that side of the other.
#[test]
fn where_nothing_was_found_the_region_speaks() {
    let field = AimField::fit(&patches(4000)).expect("there are records");
    for (p, side) in [
        (Vec3::new(0.5, 0.0, 0.5), None),
        (Vec3::new(9.0, 0.0, 0.5), Some(1.0)),
        (Vec3::new(-9.0, 1.0, 0.5), Some(-1.0)),
        (Vec3::splat(1e30), Some(1.0)),
        (Vec3::NAN, None),
    ] {
        let directions = field.directions(p, Vec3::Y);
        assert_eq!(directions.near, None, "{p}");
        if let Some(side) = side {
            let toward = Vec3::new(side, 1.0, 0.3).normalize();
            assert!(directions.pdf(toward) > 100.0, "{p}");
        }
    }
}

/// A few records far from all others, too few for a cell of their own.
#[test]
fn what_is_too_rare_for_a_cell_is_known_around_it() {
    let mut records = patches(400);
    for (number, record) in records.iter_mut().enumerate().take(4) {
        record.n = -Vec3::Y;
        record.p.y = -1.0 - number as f32;
    }
    let field = AimField::fit(&records).expect("there are records");
    let directions = field.directions(records[0].p, -Vec3::Y);
    assert_eq!(directions.near, None);
    for side in [1.0, -1.0] {
        let toward = Vec3::new(side, 1.0, 0.3).normalize();
        assert!(directions.pdf(toward) > 50.0, "{side}");
    }
}

/// The share of the region among directions, by where they go and by their density.
#[test]
fn directions_are_drawn_with_the_density_that_is_told() {
    let field = AimField::fit(&patches(4000)).expect("there are records");
    let here = field.directions(Vec3::new(5.5, 0.0, 0.5), Vec3::Y);
    let near = here
        .near
        .map(Directions::around)
        .expect("light was found here");
    let around = Directions::around(field.directions(Vec3::new(-9.0, 1.0, 0.5), Vec3::Y).around);
    let both = Directions {
        around: around.around,
        ..here
    };
    let n = 20_000;
    let left = |directions: &Directions<'_>| {
        let drawn = (0..n).map(|i| {
            directions.sample(Vec2::new(unit_f32(combine(i, 5)), unit_f32(combine(i, 6))))
        });
        drawn.filter(|wi| wi.x < 0.0).count() as f32 / n as f32
    };
    let share =
        |of: &dyn Fn(&Directions<'_>) -> f32| (of(&both) - of(&near)) / (of(&around) - of(&near));
    let toward_left = Vec3::new(-1.0, 1.0, 0.3).normalize();
    let (drawn, told) = (
        share(&left),
        share(&|directions| directions.pdf(toward_left)),
    );
    assert!((0.05..0.5).contains(&told), "{told}");
    // Four standard deviations.
    assert!(
        (drawn - told).abs() < 4.0 * (told / n as f32).sqrt(),
        "{drawn} for {told}"
    );
}

#[test]
fn few_and_broken_records_aim_at_nothing() {
    let mut records = patches(400);
    assert!(AimField::fit(&records).is_some());
    for record in &mut records[..10] {
        record.arrival.pdf = f32::INFINITY;
    }
    for record in &mut records[10..20] {
        record.p = Vec3::NAN;
    }
    assert_eq!(AimField::fit(&records), None);
    assert_eq!(AimField::fit(&[]), None);
}
