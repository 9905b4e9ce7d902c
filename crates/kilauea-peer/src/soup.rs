//! A scene as one mesh: every instance baked.

use kilauea_math::{Bounds3, DAffine3, DVec3, Vec3};
use kilauea_scene::{LightShape, Scene};

use crate::{PeerError, TriangleMesh, View, Workload};

impl Workload {
    /// All triangles of a scene, relative to its `origin_world`, seen by its camera, with about
    /// `n_rays` rays of each kind. Refuses more than `max_triangles`.
    pub fn from_scene(
        name: &str,
        scene: &Scene,
        max_triangles: usize,
        n_rays: usize,
    ) -> Result<Self, PeerError> {
        let mut soup = Soup {
            name,
            max_triangles,
            positions: Vec::new(),
            triangles: Vec::new(),
        };
        soup.place(scene, 0, DAffine3::from_translation(-scene.origin_world))?;
        let mesh = TriangleMesh::new(name, soup.positions, soup.triangles)?;
        let light = light_point(scene, mesh.bounds());
        let view = View::of_camera(&scene.camera, scene.origin_world, light);
        Self::trace_view(name, mesh, &view, n_rays)
    }
}

struct Soup<'a> {
    name: &'a str,
    max_triangles: usize,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Soup<'_> {
    fn place(
        &mut self,
        scene: &Scene,
        prototype: u32,
        engine_from_prototype: DAffine3,
    ) -> Result<(), PeerError> {
        let prototype = &scene.prototypes[prototype as usize];
        let engine_from_chunk =
            engine_from_prototype * DAffine3::from_translation(prototype.center);
        for chunk in &prototype.chunks {
            if self.triangles.len() + chunk.triangles.len() > self.max_triangles {
                return Err(PeerError::TooManyTriangles {
                    mesh: self.name.into(),
                    limit: self.max_triangles,
                });
            }
            let first = self.positions.len() as u32;
            let in_engine = |&p: &[f32; 3]| {
                let p_chunk = Vec3::from_array(p).as_dvec3();
                engine_from_chunk
                    .transform_point3(p_chunk)
                    .as_vec3()
                    .to_array()
            };
            self.positions.extend(chunk.positions.iter().map(in_engine));
            let moved = chunk.triangles.iter().map(|t| t.map(|v| first + v));
            self.triangles.extend(moved);
        }
        for group in &prototype.instances {
            for &parent_from_prototype in &group.parent_from_prototype {
                let engine_from_instance = engine_from_prototype * parent_from_prototype;
                self.place(scene, group.prototype, engine_from_instance)?;
            }
        }
        Ok(())
    }
}

/// What shadow rays aim at: the centre of the first light that has a place, else a point far
/// toward the first distant light, else one far above.
fn light_point(scene: &Scene, bounds: Bounds3) -> Vec3 {
    let is_distant = |shape: &LightShape| matches!(shape, LightShape::Distant { .. });
    let has_place = |shape: &LightShape| !is_distant(shape) && *shape != LightShape::Dome;
    let first = |wanted: &dyn Fn(&LightShape) -> bool| {
        let light = scene.lights.iter().find(|light| wanted(&light.shape))?;
        Some(light.world_from_light)
    };
    if let Some(world_from_light) = first(&has_place) {
        let p_world = world_from_light.transform_point3(DVec3::ZERO);
        return (p_world - scene.origin_world).as_vec3();
    }
    let toward_light = first(&is_distant).map_or(Vec3::Y, |world_from_light| {
        let z_world = world_from_light.transform_vector3(DVec3::Z).as_vec3();
        z_world.normalize_or(Vec3::Y)
    });
    bounds.center() + bounds.diagonal().length() * toward_light
}
