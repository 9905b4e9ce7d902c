//! The scene's surfaces as rays find them: placed prototypes, their chunks and their shaders.

mod accel_input;
mod carried;
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

use kilauea_accel::{Accel, BuildOptions, Placement, PrimitiveId, Whole};
use kilauea_math::{Bounds3, Vec3, each_of_three};
use kilauea_scene::{Attribute, InstanceAttribute, MeshChunk, Scene, Visibility};
use kilauea_shading::{Element, PrimvarSlot, Surface};
use kilauea_texture::TextureStore;
use serde::{Deserialize, Serialize};
use shaders::Shader;

use crate::RenderError;
use crate::prepared::PrepareOptions;
use accel_input::accel_geometry;
use carried::segment_of;
pub(crate) use carried::{Carried, Shape};
pub(crate) use curve::Segment;
use flatten::{Flattened, flatten};
pub(crate) use interaction::Interaction;
pub use interaction::View;
use left_out::LeftOut;
use locate::Chunk;
pub(crate) use locate::PrimitiveRef;
use locate::PrototypeIndex;
use placed::Placed;
use shape_point::ShapePoint;
pub(crate) use sphere::Ball;
pub(crate) use triangle::Triangle;

/// Everything a ray can hit, with what is needed to shade it; or a part of it.
pub struct Geometry {
    scene: Arc<Scene>,
    accel: Accel,
    left_out: LeftOut,
    shaders: Vec<Shader>,
    placements: Vec<Placed>,
    outline: Arc<Outline>,
    /// Primvar slots, by [`Placed::first_slots`] plus the chunk's number in its prototype.
    slots: Vec<Box<[PrimvarSlot]>>,
    has_instances: bool,
}

/// What all parts of a scene know of the whole: how primitives are numbered, and what their hits
/// depend on besides.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Outline {
    accel: Whole,
    /// By prototype.
    prototypes: Vec<PrototypeIndex>,
}

/// A chunk of a scene: prototype, and number in it: meshes come first, then points, then curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ChunkId {
    pub(crate) prototype: u32,
    pub(crate) chunk: u32,
}

impl Outline {
    /// Of a whole scene.
    pub(crate) fn of(scene: &Scene) -> Result<Self, RenderError> {
        let shaders: Vec<Shader> = compile(scene)?;
        let placements = flatten(scene, &shaders).accel_placements;
        let geometries = scene.prototypes.iter();
        let geometries: Vec<_> = geometries.map(|p| accel_geometry(p, |_| true)).collect();
        Ok(Self::new(scene, &geometries, &placements))
    }

    /// Whether this could be of that scene, or of a part of it.
    fn fits(&self, geometries: &[kilauea_accel::Geometry<'_>], placements: &[Placement]) -> bool {
        self.prototypes.len() == geometries.len() && self.accel.fits(geometries, placements)
    }

    fn new(
        scene: &Scene,
        geometries: &[kilauea_accel::Geometry<'_>],
        placements: &[Placement],
    ) -> Self {
        Self {
            accel: Whole::of(geometries, placements),
            prototypes: scene.prototypes.iter().map(PrototypeIndex::new).collect(),
        }
    }
}

/// The shaders of all materials.
fn compile(scene: &Scene) -> Result<Vec<Shader>, RenderError> {
    let shaders = scene.materials.iter().map(Shader::compile);
    Ok(shaders.collect::<Result<_, _>>()?)
}

impl Geometry {
    /// Flattens the prototype graph, compiles the shaders and builds the tree.
    pub fn build(scene: Arc<Scene>, options: &PrepareOptions) -> Result<Self, RenderError> {
        Self::build_part(scene, None, |_| true, options)
    }

    /// The same of a part of a scene that has been cut: rays meet the chunks that are here. Those
    /// that are not may be husks. Without an `outline` the scene is a whole.
    pub(crate) fn build_part(
        scene: Arc<Scene>,
        outline: Option<Arc<Outline>>,
        is_here: impl Fn(ChunkId) -> bool,
        options: &PrepareOptions,
    ) -> Result<Self, RenderError> {
        let shaders = compile(&scene)?;
        let Flattened {
            placements,
            accel_placements,
            slots,
            n_instances,
        } = flatten(&scene, &shaders);
        let geometries: Vec<_> = (0..)
            .zip(&scene.prototypes)
            .map(|(prototype, of)| {
                accel_geometry(of, |chunk| is_here(ChunkId { prototype, chunk }))
            })
            .collect();
        let fits = |outline: &Outline| outline.fits(&geometries, &accel_placements);
        if outline.as_deref().is_some_and(|outline| !fits(outline)) {
            return Err(RenderError::OtherScene);
        }
        let outline = outline
            .unwrap_or_else(|| Arc::new(Outline::new(&scene, &geometries, &accel_placements)));
        let build_options = BuildOptions {
            specialize: options.specialize_rays,
            ..BuildOptions::default()
        };
        let accel = Accel::build_part(
            &geometries,
            &accel_placements,
            &outline.accel,
            &build_options,
        );
        let left_out = LeftOut::of(&accel, &geometries, &placements, &scene);
        drop(geometries);
        Ok(Self {
            accel,
            left_out,
            shaders,
            placements,
            outline,
            slots,
            has_instances: n_instances > 0,
            scene,
        })
    }

    /// A box around all surfaces, those elsewhere too.
    pub fn bounds(&self) -> Bounds3 {
        self.outline.accel.bounds()
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

    /// The prototype that a placement places.
    pub(crate) fn prototype_of(&self, placement: u32) -> u32 {
        self.placements[placement as usize].prototype
    }

    /// A box in engine space around what fills `bounds` in the space of a placement's chunks, at all
    /// times, with room for all roundings.
    pub(crate) fn placed_bounds(&self, placement: u32, bounds: &Bounds3) -> Bounds3 {
        self.placements[placement as usize].motion.bounds(bounds)
    }

    /// Rays that meet a chunk of a placement.
    pub(crate) fn chunk_visibility(&self, placement: u32, chunk: u32) -> Visibility {
        self.met_by(PrimitiveRef {
            placement,
            chunk,
            primitive: 0,
        })
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
        each_of_three(triangle::corners(chunk, at.primitive, 0.0), |p| {
            transform.point(p)
        })
    }

    /// A point on a primitive as it is seen.
    #[inline]
    pub fn interaction<'a>(
        &'a self,
        at: PrimitiveRef,
        view: &View,
        textures: &'a TextureStore,
    ) -> Interaction<'a> {
        let transform = self.placements[at.placement as usize].motion.at(view.time);
        let chunk = self.chunk(at);
        let mut point;
        match chunk {
            Chunk::Mesh(mesh) => {
                point = Triangle::of(mesh, at.primitive, view.time).point(&transform, view);
                point.element = Element::triangle(mesh, at.primitive);
            }
            Chunk::Points(points) => {
                point = Ball::of(points, at.primitive, view.time).point(&transform, view);
                point.element = Element::Point(at.primitive);
            }
            Chunk::Curves(curves) => {
                point = Segment::of(curves, at.primitive, view.time).point(&transform, view);
                point.element = segment_of(curves, at.primitive, point.element);
            }
        }
        self.interaction_at(at, &point, chunk.attributes(), view, textures)
    }

    /// The same of a primitive that is elsewhere, as far as it was `carried` here.
    pub(crate) fn interaction_of_carried<'a>(
        &'a self,
        at: PrimitiveRef,
        carried: &'a Carried,
        view: &View,
        textures: &'a TextureStore,
    ) -> Interaction<'a> {
        let transform = self.placements[at.placement as usize].motion.at(view.time);
        let point = carried.shape.point(&transform, view);
        self.interaction_at(at, &point, &carried.attributes, view, textures)
    }

    #[inline(always)]
    fn interaction_at<'a>(
        &'a self,
        at: PrimitiveRef,
        point: &ShapePoint,
        attributes: &'a [Attribute],
        view: &View,
        textures: &'a TextureStore,
    ) -> Interaction<'a> {
        let placed = &self.placements[at.placement as usize];
        let (instance_primvars, instance_index) = self.instance_attributes(placed);
        let prototype = &self.outline.prototypes[placed.prototype as usize];
        Interaction {
            at,
            id: PrimitiveId {
                instance: at.placement,
                primitive: prototype.primitive(at),
            },
            surface: Surface {
                p: point.p,
                ng: point.ng,
                ns: point.ns,
                wo: view.wo,
                corners: point.corners,
                barycentrics: point.barycentrics,
                attributes,
                element: point.element,
                primvars: &self.slots[(placed.first_slots + at.chunk) as usize],
                instance_primvars,
                instance_index,
                outside_ior: 1.0,
                footprint: view.footprint,
                textures,
            },
            p_error: point.p_error,
            shader: self.shader(at),
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
