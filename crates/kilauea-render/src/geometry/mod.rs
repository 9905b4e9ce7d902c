//! The scene's surfaces as rays find them: placed prototypes, their chunks and their shaders.

mod accel_input;
mod curve;
mod flatten;
mod interaction;
pub(crate) mod keys;
mod left_out;
mod locate;
mod placed;
mod shape_point;
mod sphere;
mod triangle;

use std::sync::Arc;

use kilauea_accel::{Accel, BuildOptions};
use kilauea_math::Vec3;
use kilauea_scene::{InstanceAttribute, MeshChunk, Scene, Visibility};
use kilauea_shading::{PrimvarSlot, Surface};
use kilauea_texture::TextureStore;
use shaders::Shader;

use crate::RenderError;
use crate::prepared::PrepareOptions;
use accel_input::accel_geometry;
use flatten::{Flattened, flatten};
pub(crate) use interaction::Interaction;
pub use interaction::View;
use left_out::LeftOut;
use locate::Chunk;
pub(crate) use locate::PrimitiveRef;
use locate::PrototypeIndex;
use placed::Placed;

/// Everything a ray can hit, with what is needed to shade it.
pub struct Geometry {
    scene: Arc<Scene>,
    accel: Accel,
    left_out: LeftOut,
    shaders: Vec<Shader>,
    placements: Vec<Placed>,
    /// By prototype.
    prototypes: Vec<PrototypeIndex>,
    /// Primvar slots, by [`Placed::first_slots`] plus the chunk's number in its prototype.
    slots: Vec<Box<[PrimvarSlot]>>,
    has_instances: bool,
}

impl Geometry {
    /// Flattens the prototype graph, compiles the shaders and builds the tree.
    pub fn build(scene: Arc<Scene>, options: &PrepareOptions) -> Result<Self, RenderError> {
        let shaders: Vec<Shader> = scene
            .materials
            .iter()
            .map(Shader::compile)
            .collect::<Result<_, _>>()?;
        let Flattened {
            placements,
            accel_placements,
            slots,
            n_instances,
        } = flatten(&scene, &shaders);
        let geometries: Vec<_> = scene.prototypes.iter().map(accel_geometry).collect();
        let build_options = BuildOptions {
            specialize: options.specialize_rays,
            ..BuildOptions::default()
        };
        let accel = Accel::build(&geometries, &accel_placements, &build_options);
        let left_out = LeftOut::of(&accel, &geometries, &placements, &scene);
        drop(geometries);
        Ok(Self {
            accel,
            left_out,
            shaders,
            placements,
            prototypes: scene.prototypes.iter().map(PrototypeIndex::new).collect(),
            slots,
            has_instances: n_instances > 0,
            scene,
        })
    }

    /// The acceleration structure.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// What the tree leaves out, in a line that names prims; none where it has everything.
    pub fn left_out(&self) -> Option<String> {
        self.left_out.line(&self.scene)
    }

    /// Shaders by material.
    pub fn shaders(&self) -> &[Shader] {
        &self.shaders
    }

    /// Whether anything is placed besides the world itself.
    pub fn has_instances(&self) -> bool {
        self.has_instances
    }

    /// Number of placements.
    pub fn n_placements(&self) -> usize {
        self.placements.len()
    }

    /// Whether a placement moves while the shutter is open.
    pub fn is_moving(&self, placement: u32) -> bool {
        self.placements[placement as usize].motion.is_moving()
    }

    /// Rays that meet a placement, as far as its chunks let them.
    pub fn visibility(&self, placement: u32) -> Visibility {
        self.placements[placement as usize].visibility
    }

    /// Rays that meet a primitive.
    pub fn met_by(&self, at: PrimitiveRef) -> Visibility {
        self.chunk(at).visibility() & self.visibility(at.placement)
    }

    /// Mesh chunks of a placement's prototype.
    pub fn meshes(&self, placement: u32) -> &[MeshChunk] {
        let prototype = self.placements[placement as usize].prototype;
        &self.scene.prototypes[prototype as usize].chunks
    }

    /// The source prim and the instance of a primitive.
    pub fn ids(&self, at: PrimitiveRef) -> (i32, i32) {
        let prim_idx = self.chunk(at).prim_idx();
        let instance_id = self.placements[at.placement as usize].instance_id;
        (prim_idx as i32, instance_id)
    }

    /// The material of a primitive.
    #[inline]
    pub fn material(&self, at: PrimitiveRef) -> u32 {
        self.chunk(at).material()
    }

    /// The shader of a primitive.
    #[inline]
    pub fn shader(&self, at: PrimitiveRef) -> &Shader {
        &self.shaders[self.material(at) as usize]
    }

    /// Path of a primitive's material.
    pub fn material_path(&self, at: PrimitiveRef) -> &str {
        &self.scene.materials[self.material(at) as usize].path
    }

    /// A primitive in words: its prim and its material.
    pub fn name(&self, at: PrimitiveRef) -> String {
        let prim = self.scene.prim_path(self.ids(at).0.cast_unsigned());
        format!("{prim} of material {}", self.material_path(at))
    }

    /// Corner points of a triangle in engine space, in the chunk's winding, as the shutter opens.
    #[inline]
    pub fn corners(&self, at: PrimitiveRef) -> [Vec3; 3] {
        let transform = self.placements[at.placement as usize].motion.at(0.0);
        let chunk = &self.meshes(at.placement)[at.chunk as usize];
        triangle::corners(chunk, at.primitive, 0.0).map(|p| transform.point(p))
    }

    /// A point on a primitive as it is seen.
    #[inline]
    pub fn interaction<'a>(
        &'a self,
        at: PrimitiveRef,
        view: &View,
        textures: &'a TextureStore,
    ) -> Interaction<'a> {
        let placed = &self.placements[at.placement as usize];
        let transform = placed.motion.at(view.time);
        let chunk = self.chunk(at);
        let point = match chunk {
            Chunk::Mesh(mesh) => triangle::triangle_point(mesh, at.primitive, &transform, view),
            Chunk::Points(points) => sphere::sphere_point(points, at.primitive, &transform, view),
            Chunk::Curves(curves) => curve::curve_point(curves, at.primitive, &transform, view),
        };
        let (instance_primvars, instance_index) = self.instance_attributes(placed);
        Interaction {
            at,
            surface: Surface {
                p: point.p,
                ng: point.ng,
                ns: point.ns,
                wo: view.wo,
                corners: point.corners,
                barycentrics: point.barycentrics,
                attributes: chunk.attributes(),
                element: point.element,
                primvars: &self.slots[(placed.first_slots + at.chunk) as usize],
                instance_primvars,
                instance_index,
                outside_ior: 1.0,
                footprint: view.footprint,
                textures,
            },
            p_error: point.p_error,
            shader: &self.shaders[chunk.material() as usize],
            time: view.time,
        }
    }

    #[inline]
    fn instance_attributes(&self, placed: &Placed) -> (&[InstanceAttribute], u32) {
        match placed.attributes {
            None => (&[], 0),
            Some((prototype, instances, index)) => {
                let group =
                    &self.scene.prototypes[prototype as usize].instances[instances as usize];
                (&group.attributes, index)
            }
        }
    }
}
