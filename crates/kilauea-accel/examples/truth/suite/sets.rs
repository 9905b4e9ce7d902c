//! The stress sets.

use super::shapes::{Mesh, bumpy_sphere, cube, grid, placed, soup};
use super::stage::{Inside, Stage};
use kilauea_accel::Placement;
use kilauea_math::{DAffine3, DMat3, DVec3, Vec3};
use std::f64::consts::TAU;

/// Stages with something in common.
pub(crate) struct Set {
    pub(crate) name: String,
    pub(crate) stages: Vec<Stage>,
}

/// A ball of this radius about the middle of [`bumpy_sphere`] is inside it.
const BUMPY_INSIDE: f64 = 0.6;

/// All sets, in the order of the table.
pub(crate) fn all_sets() -> Vec<Set> {
    let set = |name: &str, stages| Set {
        name: name.to_owned(),
        stages,
    };
    let mut sets = vec![set("unit", vec![closed_cube(), sphere(5), sphere(2)])];
    sets.push(set(
        "tiles",
        vec![tiled(3.0, 0.0), tiled(0.3, 1.7), tiled(1.0, 1e3)],
    ));
    sets.extend((1..=7).map(|e| set(&format!("offset-1e{e}"), vec![far_sphere(10_f32.powi(e))])));
    sets.extend([-6, -3, 3, 6].map(|e| set(&format!("scale-1e{e}"), scaled(10_f32.powi(e)))));
    sets.extend([
        set("needles", [1e-2, 1e-4, 1e-6].map(needle).into()),
        set("slivers", vec![sliver_cone()]),
        set("duplicates", vec![duplicates()]),
        set("coplanar", vec![stack(0.0), stack(1.0), open(grid(4))]),
        set("soup", vec![open(soup(60, 1.0, 1)), open(soup(60, 0.2, 2))]),
        set("baked", baked()),
        set("mirrored", vec![instances(&mirrored())]),
        set("stretched", vec![instances(&stretched())]),
        set("stretched-askew", vec![instances(&stretched_askew())]),
        set("nested", vec![instances(&nested())]),
        set("far-instances", vec![instances(&far_away())]),
    ]);
    sets
}

fn identity() -> Vec<Placement> {
    vec![placed(0, DAffine3::IDENTITY)]
}

fn closed(mesh: Mesh, center: DVec3, radius: f64) -> Stage {
    Stage {
        meshes: vec![mesh],
        placements: identity(),
        insides: vec![Inside {
            placement: 0,
            center,
            radius,
        }],
    }
}

fn open(mesh: Mesh) -> Stage {
    Stage {
        meshes: vec![mesh],
        placements: identity(),
        insides: Vec::new(),
    }
}

fn stretch(mut mesh: Mesh, by: [f32; 3]) -> Mesh {
    for p in &mut mesh.positions {
        *p = [p[0] * by[0], p[1] * by[1], p[2] * by[2]];
    }
    mesh
}

fn closed_cube() -> Stage {
    closed(cube(), DVec3::splat(0.5), 0.49)
}

/// A cube of `n` by `n` squares a side, whose edges lie on the borders of boxes.
fn tiles(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let first = mesh.positions.len() as u32;
            let face = grid(n);
            let place = |p: [f32; 3]| {
                let (x, y) = (p[0] / n as f32, p[1] / n as f32);
                let mut placed = [side, x, y];
                placed.rotate_right(axis);
                placed
            };
            mesh.positions.extend(face.positions.into_iter().map(place));
            let indices = face.indices.into_iter();
            mesh.indices.extend(indices.map(|t| t.map(|i| first + i)));
        }
    }
    mesh
}

/// Tiles of a third of `size`, which is no round number.
fn tiled(size: f32, offset: f32) -> Stage {
    let offset = Vec3::new(offset, -0.7 * offset, 0.1 * offset);
    let mesh = stretch(tiles(3), [size; 3]).moved(offset);
    let center = offset.as_dvec3() + 0.5 * f64::from(size);
    closed(mesh, center, 0.49 * f64::from(size))
}

fn sphere(n: u32) -> Stage {
    closed(
        bumpy_sphere(n),
        DVec3::ZERO,
        if n == 2 { 0.4 } else { BUMPY_INSIDE },
    )
}

/// At least 16 units in the last place wide, so that it keeps its shape.
fn far_sphere(offset: f32) -> Stage {
    let radius = (16.0 * (offset.next_up() - offset)).max(1.0);
    let offset = Vec3::new(offset, 0.3 * offset, -offset);
    let mesh = stretch(bumpy_sphere(5), [radius; 3]).moved(offset);
    closed(mesh, offset.as_dvec3(), f64::from(radius) * BUMPY_INSIDE)
}

fn scaled(scale: f32) -> Vec<Stage> {
    let in_scale = f64::from(scale);
    vec![
        closed(
            stretch(bumpy_sphere(5), [scale; 3]),
            DVec3::ZERO,
            in_scale * BUMPY_INSIDE,
        ),
        closed(
            stretch(cube(), [scale; 3]),
            DVec3::splat(0.5 * in_scale),
            0.49 * in_scale,
        ),
    ]
}

/// A square rod.
fn needle(width: f32) -> Stage {
    let half = 0.5 * f64::from(width);
    let mesh = stretch(cube(), [width, 1.0, width]);
    closed(mesh, DVec3::new(half, 0.5, half), 0.9 * half)
}

/// A double cone over a ring whose points come in pairs, 1e-1 to 1e-7 apart.
fn sliver_cone() -> Stage {
    const N_PAIRS: u32 = 14;
    let mut mesh = Mesh::default();
    for pair in 0..N_PAIRS {
        let angle = TAU * f64::from(pair) / f64::from(N_PAIRS);
        let gap = 10_f64.powf(-1.0 - 6.0 * f64::from(pair) / f64::from(N_PAIRS - 1));
        mesh.positions.extend([angle, angle + gap].map(|a| {
            let (sin, cos) = a.sin_cos();
            [cos as f32, sin as f32, 0.0]
        }));
    }
    let n = 2 * N_PAIRS;
    mesh.positions.extend([[0.1, 0.0, 1.0], [0.0, 0.1, -1.0]]);
    for i in 0..n {
        let next = (i + 1) % n;
        mesh.indices.extend([[i, next, n], [next, i, n + 1]]);
    }
    closed(mesh, DVec3::ZERO, 0.5)
}

fn duplicates() -> Stage {
    let mut mesh = bumpy_sphere(3);
    let once = mesh.indices.clone();
    mesh.indices.extend([once.clone(), once].concat());
    closed(mesh, DVec3::ZERO, 0.5)
}

/// Squares, that many units in the last place apart.
fn stack(gap: f32) -> Stage {
    let mut mesh = Mesh::default();
    for layer in 0..20 {
        let z = 1.0 + layer as f32 * gap * f32::EPSILON;
        let [a, b, c, d] =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z));
        mesh.add([a, b, c]);
        mesh.add([a, c, d]);
    }
    open(mesh)
}

/// A sphere under each of the transforms.
fn instances(transforms: &[DAffine3]) -> Stage {
    Stage {
        meshes: vec![bumpy_sphere(4)],
        placements: transforms
            .iter()
            .map(|&transform| placed(0, transform))
            .collect(),
        insides: (0..transforms.len())
            .map(|placement| Inside {
                placement,
                center: DVec3::ZERO,
                radius: 0.5,
            })
            .collect(),
    }
}

fn turn(angle: f64) -> DMat3 {
    DMat3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle)
}

fn scale(x: f64, y: f64, z: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::new(x, y, z))
}

fn at(x: f64, y: f64, z: f64, matrix: DMat3) -> DAffine3 {
    DAffine3::from_mat3_translation(matrix, DVec3::new(x, y, z))
}

/// One placement each: baked into engine space.
fn baked() -> Vec<Stage> {
    [
        at(3.0, -1.0, 2.0, turn(0.7)),
        at(-40.0, 5.0, 0.0, turn(2.0) * scale(3.0, 0.5, -2.0)),
        at(1e3, 0.0, -1e3, turn(1.0) * 100.0),
    ]
    .map(|transform| instances(&[transform]))
    .into()
}

fn mirrored() -> [DAffine3; 3] {
    [
        at(-2.0, 0.0, 0.0, scale(-1.0, 1.0, 1.0)),
        at(2.0, 0.0, 0.0, turn(0.4) * scale(1.0, 1.0, -1.0)),
        at(0.0, 3.0, 0.0, turn(1.4) * scale(-0.5, -1.0, -2.0)),
    ]
}

/// Scaled along their own axes.
fn stretched() -> [DAffine3; 3] {
    [
        at(0.0, 0.0, 0.0, scale(1e4, 1.0, 1e4)),
        at(0.0, 9.0, 0.0, scale(1.0, 1e-4, 1e4)),
        at(5.0, -4.0, 0.0, scale(1e-4, 1e-4, -1e-4)),
    ]
}

/// Scaled between two turns, so that no axis of either space is along the scale's.
fn stretched_askew() -> [DAffine3; 3] {
    [
        at(0.0, 0.0, 0.0, turn(0.3) * scale(1e4, 1.0, 1e4) * turn(1.1)),
        at(0.0, 9.0, 0.0, turn(0.8) * scale(1.0, 1e-4, 1e4) * turn(2.1)),
        at(
            5.0,
            -4.0,
            0.0,
            turn(2.5) * scale(1e-2, 1e2, 1.0) * turn(0.6),
        ),
    ]
}

/// The products of three levels, as the renderer flattens them.
fn nested() -> [DAffine3; 4] {
    let outer = at(10.0, 0.0, -3.0, turn(0.2) * 5.0);
    let middle = [
        at(1.0, 1.0, 0.0, turn(1.2) * 0.2),
        at(-1.0, 0.0, 2.0, scale(-0.2, 0.2, 0.2)),
    ];
    let inner = [
        at(0.0, 6.0, 0.0, turn(2.2)),
        at(0.0, 0.0, 0.0, scale(0.5, 2.0, 1.0)),
    ];
    [
        outer * middle[0] * inner[0],
        outer * middle[0] * inner[1],
        outer * middle[1] * inner[0],
        outer * middle[1] * inner[1],
    ]
}

fn far_away() -> [DAffine3; 3] {
    [
        at(1e6, 3e5, -1e6, turn(0.5)),
        at(-1e7, 1e7, 1e7, turn(1.5) * 50.0),
        at(1e5, 0.0, 1e5, scale(1.0, -1.0, 0.1)),
    ]
}
