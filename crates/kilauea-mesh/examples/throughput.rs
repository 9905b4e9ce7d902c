//! How long assembly takes: `cargo run --release -p kilauea-mesh --example throughput`.

use std::collections::BTreeMap;
use std::time::Instant;

use kilauea_math::{DAffine3, DVec3};
use kilauea_mesh::{
    AssembleOptions, BoundaryInterpolation, FaceVaryingRule, Payloads, PolyMesh, Primvar,
    PrimvarInterpolation, Scheme, Subdivision, TriangleRule, assemble,
};
use kilauea_scene::{Camera, Material, Visibility};

/// `n` by `n` cells of wavy ground, as quads or triangles.
struct Ground {
    points: Vec<[f32; 3]>,
    counts: Vec<i32>,
    indices: Vec<i32>,
    normals: Vec<f32>,
    st: Vec<f32>,
}

impl Ground {
    fn new(n: usize, corners_per_face: usize) -> Self {
        let side = n + 1;
        let at = |x: usize, y: usize| (y * side + x) as i32;
        let quads = (0..n * n)
            .map(|i| (i % n, i / n))
            .map(|(x, y)| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
        let indices: Vec<i32> = quads
            .flat_map(|[a, b, c, d]| match corners_per_face {
                3 => vec![a, b, c, a, c, d],
                _ => vec![a, b, c, d],
            })
            .collect();
        let points: Vec<[f32; 3]> = (0..side * side)
            .map(|i| [(i % side) as f32, (i / side) as f32])
            .map(|[x, y]| [x, y, (0.1 * x).sin() * (0.1 * y).cos()])
            .collect();
        Self {
            counts: vec![corners_per_face as i32; indices.len() / corners_per_face],
            normals: points
                .iter()
                .flat_map(|p| [-0.1 * p[2], 0.0, 1.0])
                .collect(),
            st: indices
                .iter()
                .flat_map(|&i| [points[i as usize][0], points[i as usize][1]])
                .collect(),
            points,
            indices,
        }
    }

    fn mesh(&self) -> PolyMesh<'_> {
        PolyMesh {
            path: "/ground",
            prototype: 0,
            prototype_from_mesh: DAffine3::from_translation(DVec3::NEG_Z * 1e4),
            points: &self.points,
            face_vertex_counts: &self.counts,
            face_vertex_indices: &self.indices,
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

    fn with_normals(&self) -> PolyMesh<'_> {
        let mut mesh = self.mesh();
        mesh.normals = Some(primvar(3, PrimvarInterpolation::Vertex, &self.normals));
        mesh
    }

    fn with_st(&self) -> PolyMesh<'_> {
        let mut mesh = self.with_normals();
        mesh.primvars = vec![primvar(2, PrimvarInterpolation::FaceVarying, &self.st)];
        mesh
    }

    fn cage(&self) -> PolyMesh<'_> {
        let mut mesh = self.with_st();
        mesh.prototype_from_mesh = DAffine3::IDENTITY;
        mesh.subdivision = Some(Subdivision {
            scheme: Scheme::CatmullClark,
            interpolate_boundary: BoundaryInterpolation::EdgeAndCorner,
            face_varying_linear_interpolation: FaceVaryingRule::CornersPlus1,
            triangle_rule: TriangleRule::CatmullClark,
            crease_indices: &[],
            crease_lengths: &[],
            crease_sharpnesses: &[],
            corner_indices: &[],
            corner_sharpnesses: &[],
        });
        mesh
    }
}

fn primvar(width: u8, interpolation: PrimvarInterpolation, values: &[f32]) -> Primvar<'_> {
    Primvar {
        name: "st",
        width,
        interpolation,
        values,
        indices: None,
    }
}

fn measure(name: &str, meshes: Vec<PolyMesh<'_>>) {
    let payloads = Payloads {
        prototypes: vec![String::new()],
        meshes,
        implicits: Vec::new(),
        curves: Vec::new(),
        points: Vec::new(),
        instances: Vec::new(),
        materials: vec![Material {
            path: "/material".into(),
            shader: "Matte".into(),
            inputs: BTreeMap::new(),
            nodes: Vec::new(),
        }],
        textures: Vec::new(),
        lights: Vec::new(),
        camera: Camera::default(),
    };
    let start = Instant::now();
    match assemble(payloads, &AssembleOptions::default()) {
        Err(error) => eprintln!("{name}: {error}"),
        Ok(assembled) => {
            let seconds = start.elapsed().as_secs_f64();
            let n = assembled.n_triangles;
            eprintln!("{name}: {n} triangles in {seconds:.3} s");
        }
    }
}

fn main() {
    let small = Ground::new(31, 3);
    measure(
        "1825 meshes",
        (0..1825).map(|_| small.with_normals()).collect(),
    );
    measure(
        "1825 meshes with faceVarying st",
        (0..1825).map(|_| small.with_st()).collect(),
    );
    let large = Ground::new(1300, 3);
    measure("one mesh of triangles", vec![large.with_normals()]);
    measure("one mesh with faceVarying st", vec![large.with_st()]);
    let quads = Ground::new(1300, 4);
    measure("one mesh of quads", vec![quads.mesh()]);
    let cage = Ground::new(88, 4);
    measure("one cage, refined four times", vec![cage.cage()]);
}
