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
        Ok(Self::trace_view(name, mesh, &view, n_rays))
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

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::DMat4;
    use kilauea_scene::{Camera, Instances, MeshChunk, Projection, Prototype, Visibility};

    /// A triangle placed twice, five apart, far from the origin.
    fn scene() -> Scene {
        let triangle = Prototype {
            center: DVec3::new(0.0, 0.0, -1.0),
            chunks: vec![MeshChunk {
                positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
                triangles: vec![[0, 1, 2]],
                ..MeshChunk::default()
            }],
            ..Prototype::default()
        };
        let far = DVec3::new(1e6, 0.0, 0.0);
        let world = Prototype {
            instances: vec![Instances {
                prim_idx: 0,
                prototype: 1,
                parent_from_prototype: [0.0, 5.0]
                    .map(|y| DAffine3::from_translation(far + y * DVec3::Y))
                    .to_vec(),
                later_parent_from_prototype: Vec::new(),
                visibility: Visibility::ALL,
                attributes: Vec::new(),
            }],
            ..Prototype::default()
        };
        Scene {
            origin_world: far,
            prim_paths: Vec::new(),
            prototypes: vec![world, triangle],
            materials: Vec::new(),
            textures: Vec::new(),
            lights: Vec::new(),
            camera: Camera {
                world_from_camera: DMat4::from_translation(far + 3.0 * DVec3::Z),
                projection: Projection::Orthographic,
                screen_window: [-0.1, -0.1, 0.1, 0.1],
                clipping_range: [0.1, 100.0],
                ..Camera::default()
            },
        }
    }

    #[test]
    fn bakes_instances_and_looks_through_the_camera() {
        let workload = Workload::from_scene("two", &scene(), 2, 100).expect("two triangles");
        assert_eq!(workload.mesh.triangles(), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(workload.mesh.positions()[3], [-1.0, 4.0, -1.0]);
        let [primary, diffuse, ..] = &workload.rays[..] else {
            panic!("{:?}", workload.rays);
        };
        assert_eq!(primary.rays.len(), 100);
        assert_eq!(
            diffuse.rays.len(),
            100,
            "the first triangle fills the picture"
        );
        assert!(primary.rays.iter().all(|ray| ray.dir == [0.0, 0.0, -1.0]));
    }

    #[test]
    fn refuses_more_than_the_limit() {
        let error = Workload::from_scene("two", &scene(), 1, 100).expect_err("two are too many");
        assert!(matches!(
            error,
            PeerError::TooManyTriangles { limit: 1, .. }
        ));
    }
}
