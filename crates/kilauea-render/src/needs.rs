//! What a scene uses, found once, so that loops skip the rest.

use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeSet;

use crate::geometry::Geometry;
use crate::light::Lights;
use kilauea_scene::{Camera, Prototype, Scene, Visibility};
use shaders::Shader;

/// Declares the flags once: as fields, all set, and by name.
macro_rules! scene_needs {
    ($($(#[$doc:meta])* $flag:ident,)+) => {
        /// Features that cost time per ray or per shade.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
        pub struct SceneNeeds {
            $($(#[$doc])* pub $flag: bool,)+
        }

        impl SceneNeeds {
            /// Everything: the general code.
            pub const ALL: Self = Self { $($flag: true,)+ };

            fn flags(&mut self) -> Vec<(&'static str, &mut bool)> {
                vec![$((stringify!($flag), &mut self.$flag),)+]
            }
        }
    };
}

scene_needs! {
    /// Some surface is not opaque to rays.
    cutouts,
    /// There is any light.
    lights,
    /// There is more than one light.
    light_choice,
    /// Rays can meet lights that are not meshes.
    area_lights,
    /// Some surface emits.
    mesh_lights,
    /// Rays can meet light that comes from infinity.
    infinite_lights,
    /// Light from infinity has bright spots: rays are aimed at those that mirrors show.
    glints,
    /// Some shader reads an image.
    textures,
    /// Prototypes are placed. Skipped, with the next five, by what walks the trees.
    instances,
    /// Something moves while the shutter is open.
    motion,
    /// There are curves.
    curves,
    /// There are points.
    points,
    /// Some rays do not meet something.
    masks,
    /// Some surface bounds a medium that paths keep track of.
    media,
    /// Media have different priorities, so that boundaries can be hidden.
    nested_media,
    /// The camera has a lens.
    lens,
    /// Layers are recorded that describe surfaces: normals, positions, albedo, ids.
    surface_layers,
    /// Directions are drawn from where earlier paths found light: where that pays, so that it is
    /// known only after a frame. For the integrator `kilauea` alone.
    guided_directions,
    /// Lights are chosen by what earlier paths found them to bring; as above.
    guided_lights,
}

impl SceneNeeds {
    /// What `scene` uses, seen from `camera`.
    pub fn of(scene: &Scene, camera: &Camera, geometry: &Geometry, lights: &Lights) -> Self {
        let prototypes = &scene.prototypes;
        let used = |material: u32| {
            prototypes.iter().any(|p| {
                p.chunks.iter().any(|c| c.material == material)
                    || p.curves.iter().any(|c| c.material == material)
                    || p.points.iter().any(|c| c.material == material)
            })
        };
        let any_shader = |is_such: fn(&Shader) -> bool| {
            let mut shaders = geometry.shaders().iter().zip(0..);
            shaders.any(|(shader, idx)| is_such(shader) && used(idx))
        };
        let priorities: BTreeSet<i8> = (geometry.shaders().iter().zip(0..))
            .filter(|(_, idx)| used(*idx))
            .filter_map(|(shader, _)| Some(shader.interior()?.priority))
            .collect();
        Self {
            cutouts: any_shader(|shader| !shader.is_opaque()),
            lights: lights.len() > 0,
            light_choice: lights.len() > 1,
            area_lights: lights.has_area_lights(),
            mesh_lights: any_shader(Shader::is_emissive),
            infinite_lights: lights.rays_meet_infinite_lights(),
            glints: lights.have_bright_spots(),
            textures: !scene.textures.is_empty(),
            instances: geometry.has_instances(),
            motion: !camera.later_world_from_camera.is_empty() || prototypes.iter().any(moves),
            curves: prototypes.iter().any(|p| !p.curves.is_empty()),
            points: prototypes.iter().any(|p| !p.points.is_empty()),
            masks: prototypes.iter().any(hides),
            media: !priorities.is_empty(),
            nested_media: priorities.len() > 1,
            lens: camera.lens_radius > 0.0,
            surface_layers: true,
            guided_directions: false,
            guided_lights: false,
        }
    }

    /// The same, and the features of these names as if they were in use.
    ///
    /// # Errors
    /// Returns a name that no feature has.
    pub fn with(mut self, names: &[String]) -> Result<Self, &str> {
        for name in names {
            let mut flags = self.flags();
            let flag = flags.iter_mut().find(|(known, _)| known == name);
            let (_, flag) = flag.ok_or(name.as_str())?;
            **flag = true;
        }
        Ok(self)
    }

    /// Whether scattered rays can meet light. If not, a path's last ray would find nothing.
    pub fn met_lights(&self) -> bool {
        self.area_lights || self.mesh_lights || self.infinite_lights
    }

    /// Whether paths are to learn from others, whether it pays or not.
    pub(crate) fn learns(&self) -> bool {
        self.guided_directions || self.guided_lights
    }

    /// Names of what is needed and of what is skipped.
    pub fn names(mut self) -> (Vec<Cow<'static, str>>, Vec<Cow<'static, str>>) {
        let flags = self.flags();
        let (needed, skipped): (Vec<_>, Vec<_>) = flags.into_iter().partition(|(_, is_on)| **is_on);
        let names = |flags: Vec<(&'static str, &mut bool)>| {
            flags.into_iter().map(|(name, _)| name.into()).collect()
        };
        (names(needed), names(skipped))
    }
}

/// Whether anything in a prototype moves while the shutter is open.
pub(crate) fn moves(prototype: &Prototype) -> bool {
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
