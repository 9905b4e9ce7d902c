//! Fields: what a place gets back is what was found around it.

#![forbid(unsafe_code)]

use kilauea_gather::{GatherField, GatherRecord};
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Spectrum, Vec3};

fn number(i: u32, what: u32) -> f32 {
    unit_f32(combine(i, what))
}

/// A floor and a ceiling of a room of one unit, one above the other, both seen from within: light
/// comes from +x on the floor, from −x on the ceiling.
fn room(n: u32) -> Vec<GatherRecord> {
    (0..n)
        .map(|i| {
            let is_floor = i % 2 == 0;
            let side = if is_floor { 1.0 } else { -1.0 };
            let [x, z] = [1, 2].map(|what| number(i, what));
            GatherRecord {
                p: Vec3::new(x, if is_floor { 0.0 } else { 1.0 }, z),
                n: side * Vec3::Y,
                wi: Vec3::new(side, 0.2 * side, 0.3 * (number(i, 3) - 0.5)).normalize(),
                irradiance: 0.5 + number(i, 4),
                pdf: 0.3,
                radiance: Spectrum::new(x, if is_floor { 1.0 } else { 2.0 }, 0.0),
                n_rays: 4.0,
            }
        })
        .collect()
}

#[test]
fn a_place_gets_the_light_of_its_cell() {
    let field = GatherField::fit(&room(20_000)).expect("there are records");
    for k in 0..100 {
        let [x, z] = [1, 2].map(|what| 0.1 + 0.8 * number(k, 10 + what));
        for (y, side, expected) in [(0.0, 1.0, 1.0), (1.0, -1.0, 2.0)] {
            let (p, n) = (Vec3::new(x, y, z), side * Vec3::Y);
            let [red, green, blue] = field.reflection(p, n).radiance.to_array();
            assert!((red - x).abs() < 0.15, "{red} at {p}");
            assert!((green - expected).abs() < 1e-4 && blue == 0.0);
            let directions = field.directions(p, n).expect("light arrives");
            let toward = Vec3::new(side, 0.2 * side, 0.0).normalize();
            assert!(directions.pdf(toward) > 20.0 * directions.pdf(-toward));
        }
    }
}

#[test]
fn normals_tell_the_sides_of_a_sheet_apart() {
    let mut records = room(4000);
    for record in &mut records {
        record.p.y = 0.0;
    }
    let field = GatherField::fit(&records).expect("there are records");
    let p = Vec3::new(0.5, 0.0, 0.5);
    for (side, expected) in [(1.0, 1.0), (-1.0, 2.0)] {
        let [_, green, _] = field.reflection(p, side * Vec3::Y).radiance.to_array();
        assert!((green - expected).abs() < 1e-4, "{green}");
    }
}

#[test]
fn urgency_grows_with_what_is_uncertain_and_falls_with_cost() {
    let urgency = |spread: f32, n_rays: f32| {
        let mut records = room(2000);
        for (i, record) in (0..).zip(&mut records) {
            record.radiance = Spectrum::splat(1.0 + spread * (number(i, 5) - 0.5));
            record.n_rays = n_rays;
        }
        let field = GatherField::fit(&records).expect("there are records");
        field.reflection(Vec3::new(0.5, 0.0, 0.5), Vec3::Y).urgency
    };
    assert!(urgency(0.0, 4.0) < 1e-3);
    let once = urgency(1.0, 4.0);
    // The deviation of numbers spread evenly over a unit, over the root of four.
    assert!(
        (once - (1.0_f32 / 12.0).sqrt() / 2.0).abs() < 0.03,
        "{once}"
    );
    assert!((urgency(2.0, 4.0) / once - 2.0).abs() < 1e-3);
    assert!((urgency(1.0, 16.0) / once - 0.5).abs() < 1e-3);
}

#[test]
fn few_and_broken_records_are_no_trouble() {
    let sound = room(1);
    let broken = GatherRecord {
        p: Vec3::NAN,
        ..sound[0]
    };
    assert_eq!(GatherField::fit(&[]), None);
    assert_eq!(GatherField::fit(&[broken]), None);
    let alone = GatherField::fit(&sound).expect("there is a record");
    assert_eq!(
        GatherField::fit(&[broken, sound[0], broken]).as_ref(),
        Some(&alone)
    );
    // A place far from all records, or none at all, still has a cell.
    for p in [Vec3::splat(1e30), Vec3::splat(-1e30), Vec3::NAN] {
        let [red, ..] = alone.reflection(p, Vec3::X).radiance.to_array();
        assert_eq!(red, sound[0].radiance.to_array()[0]);
    }
    // Many records in one place cannot be divided.
    let crowd = vec![sound[0]; 5000];
    assert!(GatherField::fit(&crowd).is_some());
}
