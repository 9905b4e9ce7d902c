use super::shapes::Mesh;
use kilauea_accel::{Geometry, Placement};
use kilauea_math::{DVec3, Vec3};

/// A scene small enough to be searched triangle by triangle.
pub(crate) struct Stage {
    pub(crate) meshes: Vec<Mesh>,
    pub(crate) placements: Vec<Placement>,
    /// Where rays cannot get out.
    pub(crate) insides: Vec<Inside>,
}

/// A ball, in geometry space, inside the closed mesh of a placement.
#[derive(Clone, Copy)]
pub(crate) struct Inside {
    pub(crate) placement: usize,
    pub(crate) center: DVec3,
    pub(crate) radius: f64,
}

impl Stage {
    pub(crate) fn geometries(&self) -> Vec<Geometry<'_>> {
        self.meshes.iter().map(Mesh::geometry).collect()
    }

    pub(crate) fn mesh(&self, placement: usize) -> &Mesh {
        &self.meshes[self.placements[placement].geometry as usize]
    }

    /// Corners of a placed triangle, engine space, not rounded.
    pub(crate) fn corners(&self, placement: usize, triangle: u32) -> [DVec3; 3] {
        let world_from_geometry = &self.placements[placement].world_from_geometry;
        let corners = self.mesh(placement).corners(triangle).map(Vec3::as_dvec3);
        corners.map(|p| world_from_geometry.transform_point3(p))
    }

    /// Whether the placement's geometry is placed once, so that its corners are rounded in engine
    /// space.
    pub(crate) fn may_be_baked(&self, placement: usize) -> bool {
        let geometry = self.placements[placement].geometry;
        let n_placed = self.placements.iter().filter(|p| p.geometry == geometry);
        n_placed.count() == 1
    }
}
