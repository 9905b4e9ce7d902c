//! Aims: only near places where light was found, and from where it was found.

#![forbid(unsafe_code)]

use kilauea_gather::{AimField, Arrival, GatherRecord};
use kilauea_math::Vec3;
use kilauea_math::hash::{combine, unit_f32};

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
        let directions = field.directions(p, Vec3::Y).expect("light was found here");
        let [toward, away] = [1.0, -1.0].map(|x| Vec3::new(x * side, 1.0, 0.3).normalize());
        // By cosine it would be 0.23.
        assert!(directions.pdf(toward) > 100.0, "{}", directions.pdf(toward));
        assert!(directions.pdf(away) < 1.0, "{}", directions.pdf(away));
    }
}

#[test]
fn nothing_is_aimed_at_where_nothing_was_found() {
    let field = AimField::fit(&patches(4000)).expect("there are records");
    for p in [
        Vec3::new(0.5, 0.0, 0.5),
        Vec3::new(5.5, 1.0, 0.5),
        Vec3::splat(1e30),
        Vec3::NAN,
    ] {
        assert_eq!(field.directions(p, Vec3::Y), None, "{p}");
    }
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
