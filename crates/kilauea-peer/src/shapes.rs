//! Meshes that need no file.

use kilauea_math::Vec3;
use std::f32::consts::{PI, TAU};

use crate::{PeerError, TriangleMesh, View, Workload};

/// The meshes by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// An open room with two boxes and a lamp: 32 triangles.
    Room,
    /// A sphere with bumps: 70 thousand triangles.
    Sphere,
    /// Hills seen from low above them: 65 thousand triangles.
    Terrain,
}

impl Shape {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Room, Self::Sphere, Self::Terrain];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Room => "room",
            Self::Sphere => "sphere",
            Self::Terrain => "terrain",
        }
    }
}

/// A shape with about `n_rays` rays of each kind.
pub fn shape(shape: Shape, n_rays: usize) -> Result<Workload, PeerError> {
    /// Half the width of the picture at distance one.
    const HALF_WIDTH: f32 = 0.55;
    let (builder, eye, center, light) = match shape {
        Shape::Room => (
            room(),
            Vec3::new(0.0, -3.4, 0.0),
            Vec3::ZERO,
            Vec3::new(0.1, 0.05, 0.97),
        ),
        Shape::Sphere => (
            bumpy_sphere(187),
            Vec3::new(0.3, -2.4, 0.9),
            Vec3::ZERO,
            Vec3::new(3.0, -3.0, 4.0),
        ),
        Shape::Terrain => (
            terrain(180),
            Vec3::new(-0.6, -0.8, 0.45),
            Vec3::new(0.2, 0.2, 0.0),
            Vec3::new(2.0, 0.5, 0.7),
        ),
    };
    let name = shape.name();
    let mesh = TriangleMesh::new(name, builder.positions, builder.triangles)?;
    let view = View::look_at(eye, center, HALF_WIDTH, light);
    Ok(Workload::trace_view(name, mesh, &view, n_rays))
}

#[derive(Default)]
struct Builder {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

fn bumpy_sphere(n: u32) -> Builder {
    Builder::grid(n, |u, v| {
        let (theta, phi) = (PI * v, TAU * u);
        let bump = 1.0 + 0.15 * theta.sin() * (13.0 * phi).sin() * (15.0 * theta).cos();
        let unit = Vec3::new(
            theta.sin() * phi.cos(),
            theta.sin() * phi.sin(),
            theta.cos(),
        );
        bump * unit
    })
}

fn terrain(n: u32) -> Builder {
    Builder::grid(n, |u, v| {
        let [x, y] = [2.0 * u - 1.0, 2.0 * v - 1.0];
        let z = (1..6).fold(0.0, |z, octave| {
            let f = 2.0_f32.powi(octave);
            z + 0.25 / f * (f * 3.0 * x + f).sin() * (f * 2.7 * y + 1.7 * f).cos()
        });
        Vec3::new(x, y, z)
    })
}

fn room() -> Builder {
    let mut room = Builder::default();
    let without_bottom = [0, 1, 2, 3, 5];
    room.add_box(Vec3::ZERO, Vec3::ONE, 0.0, &[0, 1, 2, 4, 5]);
    let tall = Vec3::new(0.3, 0.3, 0.6);
    room.add_box(Vec3::new(-0.35, 0.3, -0.4), tall, 0.3, &without_bottom);
    let low = Vec3::splat(0.3);
    room.add_box(Vec3::new(0.35, -0.3, -0.7), low, -0.3, &without_bottom);
    let lamp = Vec3::new(0.25, 0.25, 0.0);
    room.add_box(Vec3::new(0.0, 0.0, 0.99), lamp, 0.0, &[5]);
    room
}

impl Builder {
    /// `n` by `n` quads over the unit square, as `surface` bends it.
    fn grid(n: u32, surface: impl Fn(f32, f32) -> Vec3) -> Self {
        let mut grid = Self::default();
        for row in 0..=n {
            for column in 0..=n {
                let [u, v] = [column, row].map(|i| i as f32 / n as f32);
                grid.positions.push(surface(u, v).to_array());
            }
        }
        for row in 0..n {
            for column in 0..n {
                let a = row * (n + 1) + column;
                let [b, c, d] = [a + 1, a + n + 1, a + n + 2];
                grid.triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        grid
    }

    /// Some faces of a box turned about z: x low, x high, y high, y low, z low, z high.
    fn add_box(&mut self, center: Vec3, half: Vec3, angle: f32, faces: &[usize]) {
        const FACES: [[u32; 4]; 6] = [
            [0, 2, 6, 4],
            [1, 3, 7, 5],
            [2, 3, 7, 6],
            [0, 1, 5, 4],
            [0, 1, 3, 2],
            [4, 5, 7, 6],
        ];
        let first = self.positions.len() as u32;
        let (sin, cos) = angle.sin_cos();
        for corner in 0..8 {
            let sign = [0, 1, 2].map(|axis| (corner >> axis & 1) as f32 * 2.0 - 1.0);
            let p = Vec3::from_array(sign) * half;
            let turned = Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z);
            self.positions.push((center + turned).to_array());
        }
        for &face in faces {
            let [a, b, c, d] = FACES[face].map(|i| first + i);
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_ray_is_there_and_valid() {
        let workload = shape(Shape::Room, 1000).expect("a valid shape");
        assert_eq!(workload.mesh.triangles().len(), 32);
        let kinds: Vec<&str> = workload.rays.iter().map(|set| &*set.kind).collect();
        assert_eq!(
            kinds,
            ["primary", "diffuse", "shadow", "occlusion", "random"]
        );
        for set in &workload.rays {
            assert!(set.rays.len() > 500, "{}: {}", set.kind, set.rays.len());
            assert!(set.rays.iter().all(crate::Segment::is_valid));
        }
    }
}
