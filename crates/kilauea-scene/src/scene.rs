use kilauea_math::DVec3;

use crate::prototype_check::check_prototypes;
use crate::{Camera, Light, Material, Prototype, SceneError, TextureSource};

/// Everything a frame needs; immutable while it renders.
#[derive(Clone, Debug)]
pub struct Scene {
    /// World-space point that engine positions are relative to, so that `f32` keeps its precision
    /// far from the origin; equals `prototypes[0].center`.
    pub origin_world: DVec3,
    /// Prim paths by primId.
    pub prim_paths: Vec<String>,
    /// Geometry; entry 0 is the world.
    pub prototypes: Vec<Prototype>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Prepared images.
    pub textures: Vec<TextureSource>,
    /// Lights besides emissive meshes.
    pub lights: Vec<Light>,
    /// The camera.
    pub camera: Camera,
}

impl Scene {
    /// Checks every index and number that the engine relies on.
    pub fn validate(&self) -> Result<(), SceneError> {
        check_prototypes(self)?;
        self.check_acyclic()?;
        self.check_materials()?;
        self.check_lights()?;
        self.camera.check()
    }

    /// The path of a prim by its primId.
    pub fn prim_path(&self, prim_idx: u32) -> &str {
        let path = self.prim_paths.get(prim_idx as usize);
        path.map_or("<unknown prim>", String::as_str)
    }

    /// Bytes of all chunk arrays.
    pub fn n_bytes(&self) -> usize {
        self.prototypes.iter().map(Prototype::n_bytes).sum()
    }

    fn check_acyclic(&self) -> Result<(), SceneError> {
        #[derive(Clone, Copy, PartialEq)]
        enum Mark {
            New,
            Open,
            Done,
        }
        fn visit(scene: &Scene, idx: usize, marks: &mut [Mark]) -> Result<(), SceneError> {
            match marks[idx] {
                Mark::Done => return Ok(()),
                Mark::Open => {
                    return Err(SceneError::Cycle {
                        path: scene.prototypes[idx].path.clone(),
                    });
                }
                Mark::New => marks[idx] = Mark::Open,
            }
            for instances in &scene.prototypes[idx].instances {
                visit(scene, instances.prototype as usize, marks)?;
            }
            marks[idx] = Mark::Done;
            Ok(())
        }
        let mut marks = vec![Mark::New; self.prototypes.len()];
        (0..self.prototypes.len()).try_for_each(|idx| visit(self, idx, &mut marks))
    }

    fn check_materials(&self) -> Result<(), SceneError> {
        use crate::Node;
        for material in &self.materials {
            let fail = |attribute: &str, value: u32, limit: usize| SceneError::Index {
                path: material.path.clone(),
                attribute: attribute.into(),
                at: 0,
                value: value.into(),
                limit,
            };
            for (name, input) in &material.inputs {
                if input.node as usize >= material.nodes.len() {
                    return Err(fail(name, input.node, material.nodes.len()));
                }
            }
            for (idx, node) in material.nodes.iter().enumerate() {
                match *node {
                    Node::Transform2d { input, .. } if input as usize >= idx => {
                        return Err(fail("nodes.input", input, idx));
                    }
                    Node::UvTexture { st, .. } if st as usize >= idx => {
                        return Err(fail("nodes.st", st, idx));
                    }
                    Node::UvTexture { texture, .. } if texture as usize >= self.textures.len() => {
                        return Err(fail("nodes.texture", texture, self.textures.len()));
                    }
                    Node::Constant { .. }
                    | Node::Primvar { .. }
                    | Node::Transform2d { .. }
                    | Node::UvTexture { .. } => {}
                }
            }
        }
        Ok(())
    }

    fn check_lights(&self) -> Result<(), SceneError> {
        for light in &self.lights {
            let fail = |attribute: &str, reason: &str| SceneError::Value {
                path: light.path.clone(),
                attribute: attribute.into(),
                reason: reason.into(),
            };
            if !light.radiance.is_finite() {
                return Err(fail("radiance", "not finite"));
            }
            if !light.world_from_light.is_finite() {
                return Err(fail("xformOps", "not finite"));
            }
            if light
                .texture
                .is_some_and(|t| t as usize >= self.textures.len())
            {
                return Err(fail("texture", "no such texture"));
            }
        }
        Ok(())
    }
}
