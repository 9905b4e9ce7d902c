//! The scene's surfaces as rays find them: placed prototypes, their chunks and their shaders.

use kilauea_accel::{
    Accel, BuildOptions, Hit, Placement, PlacementError, Quality, Ray, SurfacePoint, offset_origin,
};
use kilauea_math::{DAffine3, DVec3, Mat3, Vec2, Vec3};
use kilauea_scene::{InstanceAttribute, MeshChunk, Scene};
use kilauea_shading::{PrimvarLayout, PrimvarSlot, Surface};
use kilauea_texture::TextureStore;
use shaders::Shader;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::RenderError;

/// Everything a ray can hit, with what is needed to shade it.
pub struct Geometry {
    scene: Arc<Scene>,
    accel: Accel,
    shaders: Vec<Shader>,
    placements: Vec<Placed>,
    /// By prototype: index of its first chunk in `chunks`, and the number of triangles before each
    /// of its chunks.
    prototypes: Vec<PrototypeIndex>,
    /// Primvar slots, by [`Placed::first_slots`] plus the chunk's index in its prototype.
    slots: Vec<Box<[PrimvarSlot]>>,
    has_instances: bool,
}

/// A prototype placed in engine space.
#[derive(Clone, Debug)]
struct Placed {
    prototype: u32,
    engine_from_chunk: DAffine3,
    is_identity: bool,
    error: PlacementError,
    /// Matrix of `engine_from_chunk`.
    linear: Mat3,
    /// −1 where the placement mirrors.
    handedness: f32,
    /// Index into [`Geometry::slots`] of the prototype's first chunk.
    first_slots: u32,
    /// Which per-instance primvars apply: prototype, its instances, and the index in them.
    attributes: Option<(u32, u32, u32)>,
    /// Number of the placement among all that are not the world: the instanceId.
    instance_id: i32,
}

#[derive(Clone, Debug, Default)]
struct PrototypeIndex {
    triangles_before: Vec<u32>,
}

/// A triangle of a placed prototype.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleRef {
    /// Placement.
    pub placement: u32,
    /// Chunk of the placement's prototype.
    pub chunk: u32,
    /// Triangle of the chunk.
    pub triangle: u32,
}

/// A point on a surface, before any shader ran.
#[derive(Clone, Copy)]
pub struct Interaction<'a> {
    /// Which triangle.
    pub at: TriangleRef,
    /// What shaders see.
    pub surface: Surface<'a>,
    /// By axis: how far `surface.p` may be from the surface that rays are tested against.
    pub p_error: Vec3,
    /// The material's shader.
    pub shader: &'a Shader,
}

impl Geometry {
    /// Flattens the prototype graph, compiles the shaders and builds the tree, at the quality that
    /// pays for `n_camera_samples`.
    pub fn build(scene: Arc<Scene>, n_camera_samples: u64) -> Result<Self, RenderError> {
        let shaders: Vec<Shader> = scene
            .materials
            .iter()
            .map(Shader::compile)
            .collect::<Result<_, _>>()?;
        let mut flat = Flattening {
            scene: &scene,
            shaders: &shaders,
            placements: Vec::new(),
            accel_placements: Vec::new(),
            slots: Vec::new(),
            slots_of: BTreeMap::new(),
            n_instances: 0,
        };
        let engine_from_world = DAffine3::from_translation(-scene.origin_world);
        flat.place(0, engine_from_world, None, -1);
        let Flattening {
            placements,
            accel_placements,
            slots,
            n_instances,
            ..
        } = flat;
        let geometries: Vec<kilauea_accel::Geometry<'_>> = scene
            .prototypes
            .iter()
            .map(|prototype| kilauea_accel::Geometry {
                meshes: prototype
                    .chunks
                    .iter()
                    .map(|c| (&c.positions[..], &c.triangles[..]))
                    .collect(),
            })
            .collect();
        let options = BuildOptions {
            quality: tree_quality(&scene, n_camera_samples),
            ..BuildOptions::default()
        };
        let accel = Accel::build(&geometries, &accel_placements, &options);
        drop(geometries);
        let prototypes = scene
            .prototypes
            .iter()
            .map(|prototype| {
                let mut n = 0;
                let triangles_before = prototype.chunks.iter().map(|chunk| {
                    let before = n;
                    n += chunk.triangles.len() as u32;
                    before
                });
                PrototypeIndex {
                    triangles_before: triangles_before.collect(),
                }
            })
            .collect();
        Ok(Self {
            accel,
            shaders,
            placements,
            prototypes,
            slots,
            has_instances: n_instances > 0,
            scene,
        })
    }

    /// The acceleration structure.
    pub fn accel(&self) -> &Accel {
        &self.accel
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

    /// Chunks of a placement's prototype.
    pub fn chunks(&self, placement: u32) -> &[MeshChunk] {
        let prototype = self.placements[placement as usize].prototype;
        &self.scene.prototypes[prototype as usize].chunks
    }

    /// The source prim and the instance of a triangle.
    pub fn ids(&self, at: TriangleRef) -> (i32, i32) {
        let chunk = &self.chunks(at.placement)[at.chunk as usize];
        let instance_id = self.placements[at.placement as usize].instance_id;
        (chunk.prim_idx as i32, instance_id)
    }

    /// Which triangle was hit.
    #[inline]
    pub fn locate(&self, hit: &Hit) -> TriangleRef {
        let placed = &self.placements[hit.instance as usize];
        let before = &self.prototypes[placed.prototype as usize].triangles_before;
        let chunk = match before.len() {
            1 => 0,
            _ => before.partition_point(|&n| n <= hit.triangle) - 1,
        };
        TriangleRef {
            placement: hit.instance,
            chunk: chunk as u32,
            triangle: hit.triangle - before[chunk],
        }
    }

    /// The shader of a triangle.
    #[inline]
    pub fn shader(&self, at: TriangleRef) -> &Shader {
        let chunk = &self.chunks(at.placement)[at.chunk as usize];
        &self.shaders[chunk.material as usize]
    }

    /// Corner points in engine space, in the chunk's winding.
    #[inline]
    pub fn corners(&self, at: TriangleRef) -> [Vec3; 3] {
        self.exact_corners(at).map(DVec3::as_vec3)
    }

    /// Corner points in engine space before they are rounded, as the accelerator places them.
    #[inline]
    fn exact_corners(&self, at: TriangleRef) -> [DVec3; 3] {
        let placed = &self.placements[at.placement as usize];
        let chunk = &self.chunks(at.placement)[at.chunk as usize];
        let local = chunk.corners(at.triangle as usize).map(Vec3::as_dvec3);
        if placed.is_identity {
            local
        } else {
            local.map(|p| placed.engine_from_chunk.transform_point3(p))
        }
    }

    /// The point with the given weights of the second and third corner, seen from `wo`.
    #[inline]
    pub fn interaction<'a>(
        &'a self,
        at: TriangleRef,
        barycentrics: Vec2,
        wo: Vec3,
        footprint: f32,
        textures: &'a TextureStore,
    ) -> Interaction<'a> {
        let placed = &self.placements[at.placement as usize];
        let chunk = &self.chunks(at.placement)[at.chunk as usize];
        let corners = self.exact_corners(at);
        let (u, v) = (barycentrics.x, barycentrics.y);
        let w = 1.0 - u - v;
        let point = SurfacePoint::on_triangle(corners, u, v, &placed.error);
        let ng = (point.ng * placed.handedness).normalize_or(wo);
        let ns = match &chunk.normals {
            None => ng,
            Some(normals) => {
                let [ia, ib, ic] = chunk.triangles[at.triangle as usize];
                let n = |i: u32| Vec3::from_array(normals[i as usize]);
                let local = w * n(ia) + u * n(ib) + v * n(ic);
                let ns = if placed.is_identity {
                    local
                } else {
                    placed.normal_to_engine(local)
                };
                let ns = ns.normalize_or(ng);
                if ns.dot(ng) < 0.0 { -ns } else { ns }
            }
        };
        let (instance_primvars, instance_index) = self.instance_attributes(placed);
        let slots = &self.slots[(placed.first_slots + at.chunk) as usize];
        Interaction {
            at,
            surface: Surface {
                p: point.p,
                ng,
                ns,
                wo,
                corners: corners.map(DVec3::as_vec3),
                barycentrics,
                chunk,
                triangle: at.triangle,
                primvars: slots,
                instance_primvars,
                instance_index,
                footprint,
                textures,
            },
            p_error: point.p_error,
            shader: &self.shaders[chunk.material as usize],
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

impl Placed {
    /// A normal of the prototype's space in engine space, up to its length.
    #[inline]
    fn normal_to_engine(&self, n: Vec3) -> Vec3 {
        let m = &self.linear;
        let cofactor = Mat3::from_cols(
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
            m.x_axis.cross(m.y_axis),
        );
        (cofactor * n) * self.handedness
    }
}

impl Interaction<'_> {
    /// A ray from here in the unit direction `dir`, that does not meet the triangle it leaves.
    #[inline]
    pub fn spawn_ray(&self, dir: Vec3, t_max: f32) -> Ray {
        Ray {
            t_max,
            ..Ray::new(self.offset_origin(dir), dir)
        }
    }

    /// The point, moved off the surface to the side of `dir`.
    #[inline]
    pub fn offset_origin(&self, dir: Vec3) -> Vec3 {
        offset_origin(self.surface.p, self.p_error, self.surface.ng, dir)
    }
}

/// The better tree takes some 15 µs a triangle longer to build, and spares some 0.2 µs of the rays
/// of a camera sample.
fn tree_quality(scene: &Scene, n_camera_samples: u64) -> Quality {
    let chunks = scene.prototypes.iter().flat_map(|p| &p.chunks);
    let n_triangles: u64 = chunks.map(|c| c.triangles.len() as u64).sum();
    if n_triangles.saturating_mul(75) <= n_camera_samples {
        Quality::Final
    } else {
        Quality::Preview
    }
}

/// State of the walk over the prototype graph.
struct Flattening<'a> {
    scene: &'a Scene,
    shaders: &'a [Shader],
    placements: Vec<Placed>,
    accel_placements: Vec<Placement>,
    slots: Vec<Box<[PrimvarSlot]>>,
    /// First slots of a prototype under the per-instance primvars of an instancer.
    slots_of: BTreeMap<(u32, Option<(u32, u32)>), u32>,
    n_instances: i32,
}

impl Flattening<'_> {
    fn place(
        &mut self,
        prototype_idx: u32,
        engine_from_prototype: DAffine3,
        attributes: Option<(u32, u32, u32)>,
        instance_id: i32,
    ) {
        let scene = self.scene;
        let prototype = &scene.prototypes[prototype_idx as usize];
        if !prototype.chunks.is_empty() {
            let engine_from_chunk =
                engine_from_prototype * DAffine3::from_translation(prototype.center);
            let linear = engine_from_chunk.matrix3;
            let first_slots = self.slots_for(prototype_idx, attributes);
            let is_identity = engine_from_chunk == DAffine3::IDENTITY;
            self.placements.push(Placed {
                prototype: prototype_idx,
                engine_from_chunk,
                is_identity,
                error: if is_identity {
                    PlacementError::NONE
                } else {
                    PlacementError::of(&engine_from_chunk)
                },
                linear: linear.as_mat3(),
                handedness: if linear.determinant() < 0.0 {
                    -1.0
                } else {
                    1.0
                },
                first_slots,
                attributes,
                instance_id,
            });
            self.accel_placements.push(Placement {
                geometry: prototype_idx,
                world_from_geometry: engine_from_chunk,
            });
        }
        for (group_idx, group) in prototype.instances.iter().enumerate() {
            for (idx, &parent_from_prototype) in group.parent_from_prototype.iter().enumerate() {
                // The nearest instancer that has per-instance primvars decides.
                let own = (!group.attributes.is_empty()).then_some((
                    prototype_idx,
                    group_idx as u32,
                    idx as u32,
                ));
                let id = self.n_instances;
                self.n_instances += 1;
                self.place(
                    group.prototype,
                    engine_from_prototype * parent_from_prototype,
                    own.or(attributes),
                    id,
                );
            }
        }
    }

    fn slots_for(&mut self, prototype_idx: u32, attributes: Option<(u32, u32, u32)>) -> u32 {
        let group = attributes.map(|(prototype, instances, _)| (prototype, instances));
        if let Some(&first) = self.slots_of.get(&(prototype_idx, group)) {
            return first;
        }
        let instance_attributes: &[InstanceAttribute] = match group {
            None => &[],
            Some((prototype, instances)) => {
                &self.scene.prototypes[prototype as usize].instances[instances as usize].attributes
            }
        };
        let first = self.slots.len() as u32;
        for chunk in &self.scene.prototypes[prototype_idx as usize].chunks {
            let names = self.shaders[chunk.material as usize].primvars();
            let slots = PrimvarLayout::resolve(names, chunk, instance_attributes);
            self.slots.push(slots.into_boxed_slice());
        }
        self.slots_of.insert((prototype_idx, group), first);
        first
    }
}
