//! Small stages for tests.

#![allow(dead_code, reason = "each test file uses a part")]

use std::collections::BTreeMap;

use kilauea_math::{DAffine3, DVec3, Vec3};
use kilauea_mesh::*;
use kilauea_scene::{Camera, Material, MeshChunk, Visibility};

/// A world with four materials and nothing in it.
pub(crate) fn empty<'a>() -> Payloads<'a> {
    let material = |i: usize| Material {
        path: format!("/material{i}"),
        shader: "Matte".into(),
        inputs: BTreeMap::new(),
        nodes: Vec::new(),
    };
    Payloads {
        prototypes: vec![String::new()],
        meshes: Vec::new(),
        implicits: Vec::new(),
        curves: Vec::new(),
        points: Vec::new(),
        instances: Vec::new(),
        materials: (0..4).map(material).collect(),
        textures: Vec::new(),
        lights: Vec::new(),
        camera: Camera::default(),
    }
}

pub(crate) fn mesh<'a>(
    points: &'a [[f32; 3]],
    face_vertex_counts: &'a [i32],
    face_vertex_indices: &'a [i32],
) -> PolyMesh<'a> {
    PolyMesh {
        path: "/mesh",
        prototype: 0,
        prototype_from_mesh: DAffine3::IDENTITY,
        points,
        face_vertex_counts,
        face_vertex_indices,
        hole_indices: &[],
        left_handed: false,
        double_sided: false,
        normals: None,
        primvars: Vec::new(),
        subdivision: None,
        material: 0,
        subsets: Vec::new(),
        later_keys: Vec::new(),
        visibility: Visibility::ALL,
    }
}

pub(crate) fn subdivision<'a>(scheme: Scheme) -> Subdivision<'a> {
    Subdivision {
        scheme,
        interpolate_boundary: BoundaryInterpolation::EdgeAndCorner,
        face_varying_linear_interpolation: FaceVaryingRule::CornersPlus1,
        triangle_rule: TriangleRule::CatmullClark,
        crease_indices: &[],
        crease_lengths: &[],
        crease_sharpnesses: &[],
        corner_indices: &[],
        corner_sharpnesses: &[],
    }
}

pub(crate) fn primvar<'a>(interpolation: &str, width: u8, values: &'a [f32]) -> Primvar<'a> {
    Primvar {
        name: "st",
        width,
        interpolation: interpolation.parse().expect("a USD token"),
        values,
        indices: None,
    }
}

/// A cube from −1 to 1, wound outward.
pub(crate) const CUBE_POINTS: [[f32; 3]; 8] = [
    [-1., -1., -1.],
    [1., -1., -1.],
    [-1., 1., -1.],
    [1., 1., -1.],
    [-1., -1., 1.],
    [1., -1., 1.],
    [-1., 1., 1.],
    [1., 1., 1.],
];
pub(crate) const CUBE_COUNTS: [i32; 6] = [4; 6];
pub(crate) const CUBE_INDICES: [i32; 24] = [
    0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5,
];

pub(crate) fn cube<'a>() -> PolyMesh<'a> {
    mesh(&CUBE_POINTS, &CUBE_COUNTS, &CUBE_INDICES)
}

/// `n` by `n` quads in the xy plane, from 0 to `n`, at heights of one's choice.
pub(crate) struct Grid {
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) counts: Vec<i32>,
    pub(crate) indices: Vec<i32>,
}

impl Grid {
    pub(crate) fn new(n: usize, height: impl Fn(usize, usize) -> f32) -> Self {
        let at = |x: usize, y: usize| (y * (n + 1) + x) as i32;
        let cells = (0..n * n).map(|i| (i % n, i / n));
        Self {
            points: (0..(n + 1) * (n + 1))
                .map(|i| (i % (n + 1), i / (n + 1)))
                .map(|(x, y)| [x as f32, y as f32, height(x, y)])
                .collect(),
            counts: vec![4; n * n],
            indices: cells
                .flat_map(|(x, y)| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)])
                .collect(),
        }
    }

    pub(crate) fn mesh(&self) -> PolyMesh<'_> {
        mesh(&self.points, &self.counts, &self.indices)
    }
}

pub(crate) fn options(max_subdivision_level: u32) -> AssembleOptions {
    AssembleOptions {
        max_subdivision_level,
        ..AssembleOptions::default()
    }
}

/// A world of one mesh.
pub(crate) fn assemble_one(mesh: PolyMesh<'_>, options: &AssembleOptions) -> Assembled {
    let mut payloads = empty();
    payloads.meshes.push(mesh);
    assemble(payloads, options).expect("a valid scene")
}

/// The only chunk of a world, and its points in world space.
pub(crate) fn only_chunk(assembled: &Assembled) -> (&MeshChunk, Vec<Vec3>) {
    let [world] = &assembled.scene.prototypes[..] else {
        panic!("one prototype expected");
    };
    let [chunk] = &world.chunks[..] else {
        panic!("{} chunks", world.chunks.len());
    };
    let center = world.center.as_vec3();
    let points = chunk
        .positions
        .iter()
        .map(|&p| Vec3::from_array(p) + center);
    (chunk, points.collect())
}

/// Normals of the triangles as they are wound, not normalised.
pub(crate) fn area_normals(chunk: &MeshChunk) -> Vec<Vec3> {
    (0..chunk.triangles.len())
        .map(|t| {
            let [a, b, c] = chunk.corners(t);
            0.5 * (b - a).cross(c - a)
        })
        .collect()
}

pub(crate) fn shift(x: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::X * x)
}

/// Shading normals by vertex.
pub(crate) fn normals(chunk: &MeshChunk) -> &[[f32; 3]] {
    chunk.normals.as_deref().expect("shading normals")
}
