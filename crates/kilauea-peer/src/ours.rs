//! All that the benchmark asks of `kilauea-accel`.

use kilauea_accel::{Accel, BuildOptions, Geometry, Mesh, Placement, Ray};
use kilauea_math::{DAffine3, Vec3};
use std::hint::black_box;

use crate::{Segment, Tracer, TriangleMesh};

/// Our tree over a mesh.
pub struct Ours(Accel);

impl Ours {
    /// What rows of figures call it.
    pub const NAME: &str = "ours";

    /// Builds on the threads of rayon's current pool.
    pub fn build(mesh: &TriangleMesh) -> Self {
        let geometry = Geometry {
            meshes: vec![Mesh::still(mesh.positions(), mesh.triangles())],
            ..Geometry::default()
        };
        let placement = Placement::still(0, DAffine3::IDENTITY);
        let options = BuildOptions::default();
        Self(Accel::build(&[geometry], &[placement], &options))
    }

    /// Memory of the tree, with its own copies of the triangles.
    pub fn n_bytes(&self) -> usize {
        self.0.n_bytes()
    }

    /// Distance and triangle of the nearest hit.
    pub(crate) fn hit(&self, ray: &Segment) -> Option<(f32, u32)> {
        let hit = self.0.intersect(&accel_ray(ray))?;
        Some((hit.t, hit.primitive))
    }
}

impl Tracer for Ours {
    #[inline(always)]
    fn nearest(&self, ray: &Segment) -> Option<f32> {
        // A renderer needs all of the hit, so all of it must be there.
        let hit = self.0.intersect(&accel_ray(ray));
        black_box(&hit);
        hit.map(|hit| hit.t)
    }

    #[inline(always)]
    fn nearest_coherent(&self, ray: &Segment) -> Option<f32> {
        let hit = self.0.intersect_coherent(&accel_ray(ray));
        black_box(&hit);
        hit.map(|hit| hit.t)
    }

    #[inline(always)]
    fn occluded(&self, ray: &Segment) -> bool {
        self.0.occluded(&accel_ray(ray))
    }
}

#[inline(always)]
fn accel_ray(ray: &Segment) -> Ray {
    Ray {
        t_min: ray.t_min,
        t_max: ray.t_max,
        ..Ray::new(Vec3::from_array(ray.origin), Vec3::from_array(ray.dir))
    }
}
