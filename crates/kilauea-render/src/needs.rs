//! What a scene uses, found once, so that loops skip the rest.

use serde::Serialize;

use crate::geometry::Geometry;
use crate::light::Lights;
use kilauea_scene::Scene;

/// Features that cost time per ray or per shade.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "a set of independent flags is what it is"
)]
pub struct SceneNeeds {
    /// Some surface is not opaque to rays.
    pub cutouts: bool,
    /// There is any light.
    pub lights: bool,
    /// Rays can meet lights that are not meshes.
    pub area_lights: bool,
    /// Some mesh emits.
    pub mesh_lights: bool,
    /// Light comes from infinity.
    pub infinite_lights: bool,
    /// Some shader reads an image.
    pub textures: bool,
    /// Prototypes are placed.
    pub instances: bool,
    /// The camera has a lens.
    pub lens: bool,
}

impl SceneNeeds {
    /// Everything: the general code.
    pub const ALL: Self = Self {
        cutouts: true,
        lights: true,
        area_lights: true,
        mesh_lights: true,
        infinite_lights: true,
        textures: true,
        instances: true,
        lens: true,
    };

    /// What `scene` uses.
    pub fn of(scene: &Scene, geometry: &Geometry, lights: &Lights) -> Self {
        let used = |material: usize| {
            let in_chunk = |c: &kilauea_scene::MeshChunk| c.material as usize == material;
            scene
                .prototypes
                .iter()
                .any(|p| p.chunks.iter().any(in_chunk))
        };
        let cutouts = geometry
            .shaders()
            .iter()
            .enumerate()
            .any(|(idx, shader)| !shader.is_opaque() && used(idx));
        Self {
            cutouts,
            lights: lights.len() > 0,
            area_lights: lights.has_area_lights(),
            mesh_lights: lights.has_mesh_lights(),
            infinite_lights: lights.has_infinite_lights(),
            textures: !scene.textures.is_empty(),
            instances: geometry.has_instances(),
            lens: scene.camera.lens_radius > 0.0,
        }
    }

    /// Names of what is needed and of what is skipped.
    pub fn names(&self) -> (Vec<&'static str>, Vec<&'static str>) {
        let flags = [
            ("cutouts", self.cutouts),
            ("lights", self.lights),
            ("area_lights", self.area_lights),
            ("mesh_lights", self.mesh_lights),
            ("infinite_lights", self.infinite_lights),
            ("textures", self.textures),
            ("instances", self.instances),
            ("lens", self.lens),
        ];
        let (needed, skipped): (Vec<_>, Vec<_>) = flags.iter().partition(|(_, is_on)| *is_on);
        let names =
            |flags: Vec<&(&'static str, bool)>| flags.iter().map(|(name, _)| *name).collect();
        (names(needed), names(skipped))
    }
}
