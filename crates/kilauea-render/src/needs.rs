//! What a scene uses, found once, so that loops skip the rest.

use serde::Serialize;
use std::collections::BTreeSet;

use crate::geometry::Geometry;
use crate::light::Lights;
use kilauea_scene::{Prototype, Scene, Visibility};
use shaders::Shader;

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
    /// Some surface emits.
    pub mesh_lights: bool,
    /// Light comes from infinity.
    pub infinite_lights: bool,
    /// Some shader reads an image.
    pub textures: bool,
    /// Prototypes are placed.
    pub instances: bool,
    /// Something moves while the shutter is open.
    pub motion: bool,
    /// There are curves.
    pub curves: bool,
    /// There are points.
    pub points: bool,
    /// Some surface bounds a medium that paths keep track of.
    pub media: bool,
    /// Media have different priorities, so that boundaries can be hidden.
    pub nested_media: bool,
    /// Some rays do not meet something.
    pub masks: bool,
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
        motion: true,
        curves: true,
        points: true,
        media: true,
        nested_media: true,
        masks: true,
        lens: true,
    };

    /// What `scene` uses.
    pub fn of(scene: &Scene, geometry: &Geometry, lights: &Lights) -> Self {
        let prototypes = &scene.prototypes;
        let used = |material: u32| {
            prototypes.iter().any(|p| {
                p.chunks.iter().any(|c| c.material == material)
                    || p.curves.iter().any(|c| c.material == material)
                    || p.points.iter().any(|c| c.material == material)
            })
        };
        let priorities: BTreeSet<i8> = (geometry.shaders().iter().zip(0..))
            .filter(|(_, idx)| used(*idx))
            .filter_map(|(shader, _)| Some(shader.interior()?.priority))
            .collect();
        let any_shader = |is_such: fn(&Shader) -> bool| {
            let mut shaders = geometry.shaders().iter().zip(0..);
            shaders.any(|(shader, idx)| is_such(shader) && used(idx))
        };
        Self {
            cutouts: any_shader(|shader| !shader.is_opaque()),
            lights: lights.len() > 0,
            area_lights: lights.has_area_lights(),
            mesh_lights: any_shader(Shader::is_emissive),
            infinite_lights: lights.has_infinite_lights(),
            textures: !scene.textures.is_empty(),
            instances: geometry.has_instances(),
            motion: !scene.camera.later_world_from_camera.is_empty()
                || prototypes.iter().any(moves),
            curves: prototypes.iter().any(|p| !p.curves.is_empty()),
            points: prototypes.iter().any(|p| !p.points.is_empty()),
            media: !priorities.is_empty(),
            nested_media: priorities.len() > 1,
            masks: prototypes.iter().any(hides),
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
            ("motion", self.motion),
            ("curves", self.curves),
            ("points", self.points),
            ("media", self.media),
            ("nested_media", self.nested_media),
            ("masks", self.masks),
            ("lens", self.lens),
        ];
        let (needed, skipped): (Vec<_>, Vec<_>) = flags.iter().partition(|(_, is_on)| *is_on);
        let names =
            |flags: Vec<&(&'static str, bool)>| flags.iter().map(|(name, _)| *name).collect();
        (names(needed), names(skipped))
    }
}

/// Whether anything in a prototype moves while the shutter is open.
fn moves(prototype: &Prototype) -> bool {
    let instances = &prototype.instances;
    prototype.chunks.iter().any(|c| !c.later_keys.is_empty())
        || prototype.curves.iter().any(|c| !c.later_points.is_empty())
        || prototype.points.iter().any(|c| !c.later_centers.is_empty())
        || instances
            .iter()
            .any(|i| !i.later_parent_from_prototype.is_empty())
}

/// Whether some rays do not meet something in a prototype.
fn hides(prototype: &Prototype) -> bool {
    let meshes = prototype.chunks.iter().map(|c| c.visibility);
    let curves = prototype.curves.iter().map(|c| c.visibility);
    let points = prototype.points.iter().map(|c| c.visibility);
    let instances = prototype.instances.iter().map(|i| i.visibility);
    let mut all = meshes.chain(curves).chain(points).chain(instances);
    all.any(|visibility| visibility != Visibility::ALL)
}
