//! Meshes, rays and builds that the tests share.
#![allow(dead_code, reason = "each test binary uses some of these")]

use kilauea_accel::{Accel, BuildOptions, Geometry, Hit, Placement, Ray};
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{DAffine3, Vec3};

/// Positions and triangles of one mesh.
#[derive(Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) indices: Vec<[u32; 3]>,
}

impl Mesh {
    pub(crate) fn geometry(&self) -> Geometry<'_> {
        Geometry {
            meshes: vec![kilauea_accel::Mesh::still(&self.positions, &self.indices)],
            ..Geometry::default()
        }
    }

    pub(crate) fn add(&mut self, corners: [Vec3; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners.map(|p| p.to_array()));
        self.indices.push([first, first + 1, first + 2]);
    }

    pub(crate) fn moved(mut self, by: Vec3) -> Self {
        for p in &mut self.positions {
            *p = (Vec3::from_array(*p) + by).to_array();
        }
        self
    }

    pub(crate) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.indices[triangle as usize].map(|i| Vec3::from_array(self.positions[i as usize]))
    }
}

/// Numbers in [0, 1) in a fixed order.
pub(crate) struct Random(pub(crate) u32);

impl Random {
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(1);
        unit_f32(combine(self.0, 77))
    }

    pub(crate) fn index(&mut self, n: usize) -> usize {
        (self.unit() * n as f32) as usize
    }

    /// A point of the cube [-1, 1]³.
    pub(crate) fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// Triangles of about `size` in the cube [-1, 1]³.
pub(crate) fn soup(n: usize, size: f32, seed: u32) -> Mesh {
    let mut random = Random(seed << 20);
    let mut mesh = Mesh::default();
    for _ in 0..n {
        let center = random.point();
        mesh.add([0; 3].map(|_| center + size * random.point()));
    }
    mesh
}

/// A closed sphere of radius 1 with bumps, `2 n²` quads or so.
pub(crate) fn bumpy_sphere(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let n_around = 2 * n;
    for row in 0..=n {
        for column in 0..n_around {
            let theta = std::f32::consts::PI * row as f32 / n as f32;
            let phi = std::f32::consts::TAU * column as f32 / n_around as f32;
            let sin = if row == 0 || row == n {
                0.0
            } else {
                theta.sin()
            };
            let bump = 1.0 + 0.1 * sin * (9.0 * phi).sin() * (11.0 * theta).cos();
            let p = Vec3::new(sin * phi.cos(), sin * phi.sin(), theta.cos()) * bump;
            mesh.positions.push(p.to_array());
        }
    }
    for row in 0..n {
        for column in 0..n_around {
            let next = (column + 1) % n_around;
            let [a, b] = [row * n_around + column, row * n_around + next];
            let [c, d] = [a + n_around, b + n_around];
            if row > 0 {
                mesh.indices.push([a, c, b]);
            }
            if row + 1 < n {
                mesh.indices.push([b, c, d]);
            }
        }
    }
    mesh
}

/// A flat square grid in z = 0 with integer corners from 0 to `n`.
pub(crate) fn grid(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for y in 0..=n {
        for x in 0..=n {
            mesh.positions.push([x as f32, y as f32, 0.0]);
        }
    }
    for y in 0..n {
        for x in 0..n {
            let a = y * (n + 1) + x;
            let [b, c, d] = [a + 1, a + n + 1, a + n + 2];
            mesh.indices.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// The closed cube [0, 1]³.
pub(crate) fn cube() -> Mesh {
    let mut mesh = Mesh {
        positions: (0..8)
            .map(|i| [0, 1, 2].map(|axis| (i >> axis & 1) as f32))
            .collect(),
        indices: Vec::new(),
    };
    for [a, b, c, d] in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        mesh.indices.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

pub(crate) fn placed(geometry: u32, world_from_geometry: DAffine3) -> Placement {
    Placement::still(geometry, world_from_geometry)
}

/// Every combination of options over the same input; all must be valid and answer alike.
pub(crate) struct Builds(pub(crate) Vec<Accel>);

impl Builds {
    pub(crate) fn new(geometries: &[Geometry<'_>], placements: &[Placement]) -> Self {
        let mut builds = Vec::new();
        for (simd, specialize) in [(false, true), (true, true), (true, false)] {
            let options = BuildOptions { simd, specialize };
            let accel = Accel::build(geometries, placements, &options);
            assert_eq!(accel.validate(), Ok(()));
            builds.push(accel);
        }
        Self(builds)
    }

    pub(crate) fn of(mesh: &Mesh) -> Self {
        Self::new(&[mesh.geometry()], &[placed(0, DAffine3::IDENTITY)])
    }

    /// The hit that all builds agree on, bit for bit, as `occluded` does on there being one.
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.0[0].intersect(ray);
        for (index, accel) in self.0.iter().enumerate() {
            assert_eq!(accel.intersect(ray), hit, "build {index}, {ray:?}");
            assert_eq!(accel.occluded(ray), hit.is_some(), "build {index}, {ray:?}");
        }
        hit
    }
}
