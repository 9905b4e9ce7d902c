//! Fields: what a place gets back is what was found around it.

#![forbid(unsafe_code)]

use kilauea_gather::{Arrival, DirectionTree, GatherField, GatherRecord};
use kilauea_math::Vec3;
use kilauea_math::hash::{combine, unit_f32};

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
                arrival: Arrival {
                    wi: Vec3::new(side, 0.2 * side, 0.3 * (number(i, 3) - 0.5)).normalize(),
                    irradiance: 0.5 + number(i, 4),
                    pdf: 0.3,
                },
                pixel: [i as i32 % 64, i as i32 / 64],
                brought: 1.0,
            }
        })
        .collect()
}

#[test]
fn a_place_gets_the_light_of_its_cell() {
    let field = GatherField::fit(&room(20_000)).expect("there are records");
    for k in 0..100 {
        let [x, z] = [1, 2].map(|what| 0.1 + 0.8 * number(k, 10 + what));
        for (y, side) in [(0.0, 1.0), (1.0, -1.0)] {
            let (p, n) = (Vec3::new(x, y, z), side * Vec3::Y);
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
    for side in [1.0, -1.0] {
        let directions = field.directions(p, side * Vec3::Y).expect("light arrives");
        let toward = Vec3::new(side, 0.2 * side, 0.0).normalize();
        assert!(directions.pdf(toward) > 20.0 * directions.pdf(-toward));
    }
}

/// Most of what is in a cell lies on a wall, the rest is all over the room: the wall is parted from
/// the rest at once, and not record by record.
#[test]
fn what_lies_on_a_wall_makes_no_more_cells_than_its_records_fill() {
    let mut records = room(40_000);
    for (i, record) in (0..).zip(&mut records) {
        let depth = 3.0 * number(i, 5);
        let is_on_wall = i % 4 != 0;
        record.n = Vec3::X;
        record.p = Vec3::new(if is_on_wall { 0.0 } else { depth }, record.p.z, record.p.x);
    }
    let n_cells = GatherField::fit(&records)
        .expect("there are records")
        .n_cells();
    assert!((50..200).contains(&n_cells), "{n_cells}");
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
        assert_eq!(
            alone.directions(p, Vec3::X),
            DirectionTree::fit([&sound[0].arrival]).as_ref()
        );
    }
    // Many records in one place cannot be divided.
    let crowd = vec![sound[0]; 5000];
    assert!(GatherField::fit(&crowd).is_some());
}
