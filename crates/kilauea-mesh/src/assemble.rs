use kilauea_math::{DAffine3, DVec3};
use kilauea_scene::{MeshChunk, Prototype, Scene, SceneError};
use rayon::prelude::*;

use crate::bounds::{DBounds, is_singular};
use crate::chunks::{ChunkSettings, build_chunks};
use crate::implicit::{check_dimensions, implicit_surface, shape_bounds, tessellate};
use crate::instancing::{Plan, check_prototype};
use crate::nearest::{PixelScale, nearest_placements};
use crate::payload::{ImplicitShape, Payloads, PolyMesh};
use crate::polygon::{Topology, check_topology, polygon_surface};
use crate::report::Report;
use crate::subdiv::{SizeOnScreen, subdivide};
use crate::surface::is_placeable;

/// How [`assemble`] tessellates and splits.
#[derive(Clone, Debug, PartialEq)]
pub struct AssembleOptions {
    /// Triangles in a chunk.
    pub max_chunk_triangles: usize,
    /// Pixels of the picture: width, height.
    pub resolution: [u32; 2],
    /// Uniform refinements of a subdivision cage.
    pub max_subdivision_level: u32,
    /// Length of tessellated edges that is fine enough.
    pub pixels_per_edge: f32,
}

impl Default for AssembleOptions {
    fn default() -> Self {
        Self {
            max_chunk_triangles: 65_536,
            resolution: [640, 360],
            max_subdivision_level: 4,
            pixels_per_edge: 2.0,
        }
    }
}

/// A scene and what was found on the way to it.
#[derive(Debug)]
pub struct Assembled {
    /// Passes [`Scene::validate`].
    pub scene: Scene,
    /// What is not rendered as authored, each `path: attribute: what`.
    pub warnings: Vec<String>,
    /// Triangles left out because their points are not finite.
    pub n_rejected_triangles: usize,
    /// Triangles in all chunks, each prototype counted once.
    pub n_triangles: usize,
}

/// Makes a scene of triangles from meshes, cages, shapes and instances.
///
/// Prototypes that are placed exactly once become part of what places them. Geometry that does
/// not make sense is left out with a warning. The result does not depend on the number of threads.
///
/// # Errors
/// Indices outside the prototypes or materials, prototypes that contain themselves, and records
/// that [`Scene::validate`] refuses.
pub fn assemble(
    payloads: Payloads<'_>,
    options: &AssembleOptions,
) -> Result<Assembled, SceneError> {
    let mut payloads = payloads;
    if payloads.prototypes.is_empty() {
        payloads.prototypes.push(String::new());
    }
    let shapes = all_shapes(&payloads);
    for shape in &shapes {
        let n = payloads.prototypes.len();
        check_prototype(shape.path(), "prototype", shape.prototype(), n)?;
    }
    let mut report = Report::default();
    let plan = Plan::new(
        &payloads.prototypes,
        &payloads.instances,
        shapes.len() as u32,
        &mut report,
    )?;

    let (located, reports): (Vec<Option<Located<'_>>>, Vec<Report>) = shapes
        .par_iter()
        .with_max_len(1)
        .map(|shape| {
            let mut report = Report::default();
            (locate(shape, &plan, &mut report), report)
        })
        .unzip();
    for found in reports {
        report.append(found);
    }

    let spaces = Spaces::new(&plan, &located, &payloads, options);
    let (chunks, reports): (Vec<Vec<MeshChunk>>, Vec<Report>) = shapes
        .par_iter()
        .zip(&located)
        .enumerate()
        .with_max_len(1)
        .map(|(prim_idx, (shape, located))| {
            let mut report = Report::default();
            let chunks = located.as_ref().map(|located| {
                tessellate_shape(
                    shape,
                    located,
                    prim_idx as u32,
                    &spaces,
                    &plan,
                    options,
                    &mut report,
                )
            });
            (chunks.unwrap_or_default(), report)
        })
        .unzip();
    for found in reports {
        report.append(found);
    }

    let roots = located.iter().map(|l| l.as_ref().map(|l| l.root));
    let placed: Vec<(usize, Vec<MeshChunk>)> = roots
        .zip(chunks)
        .filter_map(|(root, chunks)| Some((root?, chunks)))
        .collect();
    let scene = make_scene(payloads, plan, &spaces.centers, placed);
    scene.validate()?;
    let prototypes = &scene.prototypes;
    let n_triangles = prototypes
        .iter()
        .flat_map(|p| &p.chunks)
        .map(|c| c.triangles.len())
        .sum();
    Ok(Assembled {
        scene,
        warnings: report.warnings,
        n_rejected_triangles: report.n_rejected_triangles,
        n_triangles,
    })
}

/// A mesh or an implicit shape.
enum Shape<'p, 'a> {
    Mesh(&'p PolyMesh<'a>),
    Implicit(&'p ImplicitShape<'a>),
}

impl Shape<'_, '_> {
    fn path(&self) -> &str {
        match self {
            Self::Mesh(mesh) => mesh.path,
            Self::Implicit(shape) => shape.path,
        }
    }

    fn prototype(&self) -> u32 {
        match self {
            Self::Mesh(mesh) => mesh.prototype,
            Self::Implicit(shape) => shape.prototype,
        }
    }

    fn prototype_from_mesh(&self) -> DAffine3 {
        match self {
            Self::Mesh(mesh) => mesh.prototype_from_mesh,
            Self::Implicit(shape) => shape.prototype_from_mesh,
        }
    }
}

/// Everything that becomes triangles, in the order of primIds.
fn all_shapes<'p, 'a>(payloads: &'p Payloads<'a>) -> Vec<Shape<'p, 'a>> {
    let meshes = payloads.meshes.iter().map(Shape::Mesh);
    meshes
        .chain(payloads.implicits.iter().map(Shape::Implicit))
        .collect()
}

/// A shape that will be drawn, and where.
struct Located<'a> {
    /// Scene prototype that holds it.
    root: usize,
    root_from_mesh: DAffine3,
    /// In its own space.
    bounds: DBounds,
    /// In the prototype's space.
    root_bounds: DBounds,
    /// Present on meshes.
    topology: Option<Topology<'a>>,
    n_bad_points: usize,
}

/// Checks a shape and finds its place and size; absent if there is nothing to draw.
fn locate<'a>(shape: &Shape<'_, 'a>, plan: &Plan, report: &mut Report) -> Option<Located<'a>> {
    let home = plan.homes[shape.prototype() as usize].as_ref()?;
    let root_from_mesh = home.root_from_prototype * shape.prototype_from_mesh();
    if is_singular(&root_from_mesh) {
        let what = "of no extent or not finite; prim skipped";
        report.warn(shape.path(), "transform", what);
        return None;
    }
    let mut located = Located {
        root: home.root,
        root_from_mesh,
        bounds: DBounds::EMPTY,
        root_bounds: DBounds::EMPTY,
        topology: None,
        n_bad_points: 0,
    };
    match shape {
        Shape::Implicit(shape) => {
            if !check_dimensions(shape, report) {
                return None;
            }
            located.bounds = shape_bounds(shape);
            located.root_bounds = located.bounds.transformed(&root_from_mesh);
        }
        Shape::Mesh(mesh) => {
            located.topology = Some(check_topology(mesh, report)?);
            for p in mesh.points {
                let p = DVec3::from_array(p.map(f64::from));
                let p_root = root_from_mesh.transform_point3(p);
                if is_placeable(p) && is_placeable(p_root) {
                    located.bounds.include(p);
                    located.root_bounds.include(p_root);
                } else {
                    located.n_bad_points += 1;
                }
            }
        }
    }
    let corners = [located.root_bounds.min, located.root_bounds.max];
    if !located.root_bounds.is_empty() && !corners.into_iter().all(is_placeable) {
        report.warn(shape.path(), "transform", "too large; prim skipped");
        return None;
    }
    Some(located)
}

/// Where each scene prototype lies.
struct Spaces {
    /// By scene prototype: what positions are relative to.
    centers: Vec<DVec3>,
    /// By scene prototype: placements that look largest.
    nearest: Vec<Vec<DAffine3>>,
    pixel_scale: PixelScale,
}

impl Spaces {
    fn new(
        plan: &Plan,
        located: &[Option<Located<'_>>],
        payloads: &Payloads<'_>,
        options: &AssembleOptions,
    ) -> Self {
        let mut own = vec![DBounds::EMPTY; plan.roots.len()];
        for shape in located.iter().flatten() {
            own[shape.root] = own[shape.root].union(&shape.root_bounds);
        }
        // Children come after their parents, so backwards all of them are known.
        let mut all = own.clone();
        for parent in (0..all.len()).rev() {
            for placed in &plan.instances[parent] {
                let child = all[placed.prototype as usize];
                for parent_from_child in &placed.parent_from_prototype {
                    all[parent] = all[parent].union(&child.transformed(parent_from_child));
                }
            }
        }
        // The world's center is the origin of all that is traced, even if only instances are there.
        if own[0].is_empty() {
            own[0] = all[0];
        }
        let centers = own.iter().map(|b| {
            let center = b.center();
            if b.is_empty() || !is_placeable(center) {
                DVec3::ZERO
            } else {
                center
            }
        });
        let pixel_scale = PixelScale::new(&payloads.camera, options.resolution);
        Self {
            centers: centers.collect(),
            nearest: nearest_placements(&pixel_scale, &plan.instances, &all),
            pixel_scale,
        }
    }

    /// How many pixels a unit of a shape's space covers where it looks largest.
    fn pixels_per_unit(&self, located: &Located<'_>) -> f64 {
        self.nearest[located.root]
            .iter()
            .map(|world_from_root| {
                let world_from_mesh = *world_from_root * located.root_from_mesh;
                self.pixel_scale
                    .pixels_per_unit(&world_from_mesh, &located.bounds)
            })
            .fold(0.0, f64::max)
    }
}

fn tessellate_shape(
    shape: &Shape<'_, '_>,
    located: &Located<'_>,
    prim_idx: u32,
    spaces: &Spaces,
    plan: &Plan,
    options: &AssembleOptions,
    report: &mut Report,
) -> Vec<MeshChunk> {
    let pixels_per_edge = f64::from(options.pixels_per_edge).max(1e-3);
    let (surface, double_sided) = match (shape, &located.topology) {
        (Shape::Implicit(shape), _) => {
            let pixels_per_unit = spaces.pixels_per_unit(located);
            let tessellation = tessellate(shape, pixels_per_unit, pixels_per_edge);
            let surface = implicit_surface(shape, tessellation, located.root_from_mesh, report);
            (surface, shape.double_sided)
        }
        (Shape::Mesh(_), None) => return Vec::new(),
        (Shape::Mesh(mesh), Some(topology)) => {
            let has_bad_points = located.n_bad_points > 0;
            let cage = polygon_surface(
                mesh,
                topology,
                located.root_from_mesh,
                has_bad_points,
                report,
            );
            let surface = match &mesh.subdivision {
                None => cage,
                Some(subdivision) => {
                    let size = SizeOnScreen {
                        pixels_per_unit: spaces.pixels_per_unit(located),
                        pixels_per_edge,
                        max_level: options.max_subdivision_level,
                    };
                    subdivide(mesh, subdivision, cage, size, report)
                }
            };
            (surface, mesh.double_sided)
        }
    };
    let overrides = plan.homes[shape.prototype() as usize]
        .as_ref()
        .map_or(&[][..], |home| &home.overrides);
    let settings = ChunkSettings {
        prim_idx,
        double_sided,
        center: spaces.centers[located.root],
        overrides,
        max_triangles: options.max_chunk_triangles,
    };
    let built = build_chunks(&surface, &settings);
    if located.n_bad_points > 0 {
        report.n_rejected_triangles += built.n_dropped;
        let what = format_args!(
            "{} points are not finite; {} triangles dropped",
            located.n_bad_points, built.n_dropped
        );
        report.warn(shape.path(), "points", what);
    }
    for name in &built.not_finite {
        let what = "has values that are not finite; zero instead";
        report.warn(shape.path(), &format!("primvars:{name}"), what);
    }
    built.pieces
}

fn make_scene(
    payloads: Payloads<'_>,
    plan: Plan,
    centers: &[DVec3],
    placed: Vec<(usize, Vec<MeshChunk>)>,
) -> Scene {
    let paths = &payloads.prototypes;
    let mut prototypes: Vec<Prototype> = plan
        .roots
        .iter()
        .zip(plan.instances)
        .zip(centers)
        .map(|((&source, instances), &center)| Prototype {
            path: paths[source].clone(),
            center,
            chunks: Vec::new(),
            instances,
        })
        .collect();
    for (root, mut chunks) in placed {
        prototypes[root].chunks.append(&mut chunks);
    }
    drop_empty_instances(&mut prototypes);
    let meshes = payloads.meshes.iter().map(|m| m.path);
    let implicits = payloads.implicits.iter().map(|s| s.path);
    let instancers = payloads.instances.iter().map(|i| i.path);
    Scene {
        origin_world: centers[0],
        prim_paths: meshes
            .chain(implicits)
            .chain(instancers)
            .map(str::to_owned)
            .collect(),
        prototypes,
        materials: payloads.materials,
        textures: payloads.textures,
        lights: payloads.lights,
        camera: payloads.camera,
    }
}

/// Removes instances of nothing; parents come before what they place.
fn drop_empty_instances(prototypes: &mut [Prototype]) {
    let mut is_empty = vec![true; prototypes.len()];
    for (i, prototype) in prototypes.iter_mut().enumerate().rev() {
        let instances = &mut prototype.instances;
        instances.retain(|placed| !is_empty[placed.prototype as usize]);
        is_empty[i] = instances.is_empty() && prototype.chunks.is_empty();
    }
}
