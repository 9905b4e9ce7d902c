use kilauea_math::DVec3;
use kilauea_scene::{CurvesChunk, MeshChunk, PointsChunk, Prototype, Scene, SceneError};
use rayon::prelude::*;

use crate::chunks::{ChunkSettings, build_chunks};
use crate::curves::build_curves;
use crate::implicit::{implicit_surface, tessellate};
use crate::instancing::{Plan, check_prototype};
use crate::payload::{ImplicitShape, Payloads, PolyMesh};
use crate::points::build_points;
use crate::polygon::{Topology, polygon_surface};
use crate::report::Report;
use crate::shape::{Checked, Located, Shape, all_shapes, locate};
use crate::spaces::Spaces;
use crate::subdiv::{SizeOnScreen, subdivide};
use crate::surface::Surface;

/// How [`assemble`] tessellates and splits.
#[derive(Clone, Debug, PartialEq)]
pub struct AssembleOptions {
    /// Triangles, curve segments or points in a chunk.
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

/// Makes a scene from meshes, cages, shapes, curves, points and instances.
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
    let (chunks, reports): (Vec<Chunks>, Vec<Report>) = shapes
        .par_iter()
        .zip(&located)
        .enumerate()
        .with_max_len(1)
        .map(|(prim_idx, (shape, located))| {
            let mut report = Report::default();
            let chunks = located.as_ref().map(|located| {
                let settings =
                    ChunkSettings::new(shape, prim_idx as u32, located, &spaces, &plan, options);
                build_shape(shape, located, &spaces, options, &settings, &mut report)
            });
            (chunks.unwrap_or_default(), report)
        })
        .unzip();
    for found in reports {
        report.append(found);
    }

    let roots = located.iter().map(|l| l.as_ref().map(|l| l.root));
    let placed: Vec<(usize, Chunks)> = roots
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

/// What a shape becomes.
#[derive(Default)]
struct Chunks {
    meshes: Vec<MeshChunk>,
    curves: Vec<CurvesChunk>,
    points: Vec<PointsChunk>,
}

impl<'a> ChunkSettings<'a> {
    fn new(
        shape: &Shape<'_, '_>,
        prim_idx: u32,
        located: &Located<'_>,
        spaces: &Spaces,
        plan: &'a Plan,
        options: &AssembleOptions,
    ) -> Self {
        let home = plan.homes[shape.prototype() as usize].as_ref();
        let own = shape.visibility();
        Self {
            prim_idx,
            double_sided: shape.is_double_sided(),
            center: spaces.centers[located.root],
            overrides: home.map_or(&[][..], |home| &home.overrides),
            max_primitives: options.max_chunk_triangles,
            visibility: home.map_or(own, |home| home.visibility & own),
        }
    }
}

fn build_shape(
    shape: &Shape<'_, '_>,
    located: &Located<'_>,
    spaces: &Spaces,
    options: &AssembleOptions,
    settings: &ChunkSettings<'_>,
    report: &mut Report,
) -> Chunks {
    let mut chunks = Chunks::default();
    let root_from_shape = located.root_from_shape;
    let surface = match (shape, &located.checked) {
        (Shape::Curves(curves), Checked::Curves(checked)) => {
            chunks.curves = build_curves(curves, checked, root_from_shape, settings, report);
            return chunks;
        }
        (Shape::Points(points), _) => {
            chunks.points = build_points(points, root_from_shape, settings, report);
            return chunks;
        }
        (Shape::Implicit(shape), _) => tessellated(shape, located, spaces, options, report),
        (Shape::Mesh(mesh), Checked::Mesh(topology)) => {
            mesh_surface(mesh, topology, located, spaces, options, report)
        }
        (Shape::Mesh(_) | Shape::Curves(_), _) => return chunks,
    };
    let (meshes, n_dropped) = build_chunks(shape.path(), &surface, settings, report);
    if located.n_bad_points > 0 {
        report.n_rejected_triangles += n_dropped;
        let what = format_args!(
            "{} points are not finite; {n_dropped} triangles dropped",
            located.n_bad_points
        );
        report.warn(shape.path(), "points", what);
    }
    chunks.meshes = meshes;
    chunks
}

fn tessellated<'a>(
    shape: &ImplicitShape<'a>,
    located: &Located<'_>,
    spaces: &Spaces,
    options: &AssembleOptions,
    report: &mut Report,
) -> Surface<'a> {
    let pixels_per_unit = spaces.pixels_per_unit(located);
    let tessellation = tessellate(shape, pixels_per_unit, options.edge_pixels());
    implicit_surface(shape, tessellation, located.root_from_shape, report)
}

fn mesh_surface<'a>(
    mesh: &PolyMesh<'a>,
    topology: &Topology<'a>,
    located: &Located<'_>,
    spaces: &Spaces,
    options: &AssembleOptions,
    report: &mut Report,
) -> Surface<'a> {
    let has_bad_points = located.n_bad_points > 0;
    let root_from_mesh = located.root_from_shape;
    let cage = polygon_surface(mesh, topology, root_from_mesh, has_bad_points, report);
    let Some(subdivision) = &mesh.subdivision else {
        return cage;
    };
    let size = SizeOnScreen {
        pixels_per_unit: spaces.pixels_per_unit(located),
        pixels_per_edge: options.edge_pixels(),
        max_level: options.max_subdivision_level,
    };
    subdivide(mesh, subdivision, cage, size, report)
}

impl AssembleOptions {
    fn edge_pixels(&self) -> f64 {
        f64::from(self.pixels_per_edge).max(1e-3)
    }
}

fn make_scene(
    payloads: Payloads<'_>,
    plan: Plan,
    centers: &[DVec3],
    placed: Vec<(usize, Chunks)>,
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
            instances,
            ..Prototype::default()
        })
        .collect();
    for (root, mut chunks) in placed {
        let prototype = &mut prototypes[root];
        prototype.chunks.append(&mut chunks.meshes);
        prototype.curves.append(&mut chunks.curves);
        prototype.points.append(&mut chunks.points);
    }
    drop_empty_instances(&mut prototypes);
    let shapes = all_shapes(&payloads);
    let shape_paths = shapes.iter().map(|shape| shape.path().to_owned());
    let instancer_paths = payloads.instances.iter().map(|i| i.path.to_owned());
    let prim_paths = shape_paths.chain(instancer_paths).collect();
    Scene {
        origin_world: centers[0],
        prim_paths,
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
        is_empty[i] = prototype.instances.is_empty() && prototype.has_no_surfaces();
    }
}
