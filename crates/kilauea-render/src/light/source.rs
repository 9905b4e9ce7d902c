//! Whose light a light is.

use kilauea_scene::Scene;

use super::Lights;
use crate::geometry::Geometry;

impl Lights {
    /// Number of what a light is of: of itself, or of all triangles of a mesh.
    pub(crate) fn source(&self, light: u32) -> usize {
        let (n_area, n_mesh) = (self.area.len(), self.mesh.len());
        match (light as usize).checked_sub(n_area) {
            None => light as usize,
            Some(triangle) if triangle < n_mesh => n_area + self.mesh.group(triangle as u32),
            Some(infinite) => n_area + self.mesh.groups.len() + infinite - n_mesh,
        }
    }

    /// Path of the prim that shines.
    pub(crate) fn prim_path<'s>(
        &self,
        light: u32,
        scene: &'s Scene,
        geometry: &Geometry,
    ) -> &'s str {
        let (light, n_area, n_mesh) = (light as usize, self.area.len(), self.mesh.len());
        let of_light = |idx: usize| &scene.lights[self.numbers_in_scene[idx] as usize].path;
        match light.checked_sub(n_area) {
            None => of_light(light),
            Some(triangle) if triangle < n_mesh => {
                let (at, _) = self.mesh.triangle(triangle as u32);
                let chunk = &geometry.meshes(at.placement)[at.chunk as usize];
                scene.prim_path(chunk.prim_idx)
            }
            Some(_) => of_light(light - n_mesh),
        }
    }
}
