use crate::build::{has_inverse, in_range, instance_bounds};
use crate::geometry::{Curves, Geometry, Mesh, Placement, Spheres};
use crate::visibility::Visibility;
use kilauea_math::{Bounds3, DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What the hits of a part of a scene owe to the whole: the numbers that they report, and what is
/// rounded where.
///
/// Made before a scene is cut. Each part is then built with it by [`Accel::build_part`], and hits
/// what the whole hits, bit for bit, as far as it is there.
///
/// [`Accel::build_part`]: crate::Accel::build_part
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Whole {
    bounds: Bounds3,
    pub(crate) geometries: Vec<WholeGeometry>,
    /// By placement: whether still triangles are rounded in engine space, or keep a space of their
    /// own.
    is_baked: Vec<bool>,
}

/// A geometry before it is cut.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct WholeGeometry {
    pub(crate) first_ids: FirstIds,
    /// Around all that can be hit, at all times; rays into placed trees start where they enter it.
    pub(crate) bounds: Bounds3,
}

/// The number of the first primitive, by mesh, group of spheres and group of curves.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct FirstIds {
    meshes: Vec<u32>,
    spheres: Vec<u32>,
    curves: Vec<u32>,
}

/// A geometry, perhaps a part of one, whose primitives have the numbers of the whole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numbered<'g, 'a> {
    pub(crate) geometry: &'g Geometry<'a>,
    pub(crate) first_ids: &'g FirstIds,
}

impl Whole {
    /// Looks at a whole scene.
    pub fn of(geometries: &[Geometry<'_>], placements: &[Placement]) -> Self {
        let mut n_placed = vec![0_u32; geometries.len()];
        let is_valid = |placement: &Placement| {
            (placement.geometry as usize) < geometries.len()
                && placement.keys().iter().all(has_inverse)
        };
        for placement in placements.iter().filter(|p| is_valid(p)) {
            n_placed[placement.geometry as usize] += 1;
        }
        let is_baked = |placement: &Placement| {
            let geometry = placement.geometry as usize;
            is_valid(placement)
                && n_placed[geometry] == 1
                && placement.motion.is_none()
                && keeps_shape(&geometries[geometry], &placement.world_from_geometry)
        };
        let is_baked = placements.par_iter().map(is_baked).collect();
        let geometries: Vec<WholeGeometry> = geometries.par_iter().map(WholeGeometry::of).collect();
        let around = |placement: &Placement| {
            let bounds = geometries.get(placement.geometry as usize)?.bounds;
            if bounds.is_empty() || !is_valid(placement) {
                return None;
            }
            let placed = instance_bounds(&[bounds], placement.keys())?;
            Some(Bounds3 {
                min: placed.min.into(),
                max: placed.max.into(),
            })
        };
        let placed = placements.iter().filter_map(around);
        Self {
            bounds: placed.fold(Bounds3::EMPTY, |all, bounds| all.union(&bounds)),
            is_baked,
            geometries,
        }
    }

    /// A box around everything that can be hit, at any time.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Whether this could be of these geometries and placements, by their numbers.
    pub fn fits(&self, geometries: &[Geometry<'_>], placements: &[Placement]) -> bool {
        let fits = |(known, geometry): (&WholeGeometry, &Geometry<'_>)| {
            let FirstIds {
                meshes,
                spheres,
                curves,
            } = &known.first_ids;
            meshes.len() == geometry.meshes.len()
                && spheres.len() == geometry.spheres.len()
                && curves.len() == geometry.curves.len()
        };
        self.is_baked.len() == placements.len()
            && self.geometries.len() == geometries.len()
            && self.geometries.iter().zip(geometries).all(fits)
    }

    pub(crate) fn is_baked(&self, placement: u32) -> bool {
        self.is_baked[placement as usize]
    }
}

impl WholeGeometry {
    fn of(geometry: &Geometry<'_>) -> Self {
        let meshes: Vec<Bounds3> = geometry.meshes.par_iter().map(mesh_bounds).collect();
        let spheres = geometry.spheres.iter().map(sphere_bounds);
        let curves = geometry.curves.iter().map(curve_bounds);
        let all = meshes.into_iter().chain(spheres).chain(curves);
        let bounds = all.fold(Bounds3::EMPTY, |all, bounds| all.union(&bounds));
        Self {
            first_ids: FirstIds::of(geometry),
            bounds: with_border(bounds),
        }
    }
}

impl FirstIds {
    pub(crate) fn of(geometry: &Geometry<'_>) -> Self {
        let mut next = 0;
        let mut number = |n: usize| {
            let first = next;
            next += n as u32;
            first
        };
        Self {
            meshes: (geometry.meshes.iter().map(|mesh| mesh.triangles.len()))
                .map(&mut number)
                .collect(),
            spheres: (geometry.spheres.iter().map(|group| group.radii.len()))
                .map(&mut number)
                .collect(),
            curves: (geometry.curves.iter().map(|group| group.segments.len()))
                .map(&mut number)
                .collect(),
        }
    }
}

impl<'g, 'a> Numbered<'g, 'a> {
    /// Meshes, each with the number of its first triangle.
    pub(crate) fn meshes(self) -> impl Iterator<Item = (&'g Mesh<'a>, u32)> {
        let first_ids = self.first_ids.meshes.iter().copied();
        self.geometry.meshes.iter().zip(first_ids)
    }

    /// Groups of spheres, each with the number of its first.
    pub(crate) fn spheres(self) -> impl Iterator<Item = (&'g Spheres<'a>, u32)> {
        let first_ids = self.first_ids.spheres.iter().copied();
        self.geometry.spheres.iter().zip(first_ids)
    }

    /// Groups of curves, each with the number of its first segment.
    pub(crate) fn curves(self) -> impl Iterator<Item = (&'g Curves<'a>, u32)> {
        let first_ids = self.first_ids.curves.iter().copied();
        self.geometry.curves.iter().zip(first_ids)
    }
}

/// Room for the border that boxes have around triangles.
fn with_border(bounds: Bounds3) -> Bounds3 {
    if bounds.is_empty() {
        return bounds;
    }
    let border = 8.0 * f32::EPSILON * bounds.diagonal().max_element();
    Bounds3 {
        min: bounds.min - border,
        max: bounds.max + border,
    }
}

/// Around all points of triangles, degenerate ones too: to look at triangles would take several times
/// as long.
fn mesh_bounds(mesh: &Mesh<'_>) -> Bounds3 {
    if mesh.visibility == Visibility::NONE {
        return Bounds3::EMPTY;
    }
    let points = mesh.positions.iter().copied().flatten();
    Bounds3::from_points(
        points
            .filter(|p| in_range(p))
            .copied()
            .map(Vec3::from_array),
    )
}

fn sphere_bounds(group: &Spheres<'_>) -> Bounds3 {
    if group.visibility == Visibility::NONE {
        return Bounds3::EMPTY;
    }
    let keys = group.centers.iter();
    let balls = keys.flat_map(|centers| centers.iter().copied().zip(group.radii.iter().copied()));
    around_balls(balls)
}

/// Control points hold what lies between them.
fn curve_bounds(group: &Curves<'_>) -> Bounds3 {
    if group.visibility == Visibility::NONE {
        return Bounds3::EMPTY;
    }
    let keys = group.points.iter();
    let balls = keys.flat_map(|points| points.iter().copied().zip(group.radii.iter().copied()));
    around_balls(balls)
}

fn around_balls(balls: impl Iterator<Item = ([f32; 3], f32)>) -> Bounds3 {
    let mut bounds = Bounds3::EMPTY;
    for (center, radius) in balls {
        if in_range(&center) && in_range(&[radius; 3]) && radius >= 0.0 {
            let center = Vec3::from_array(center);
            bounds.include(center - radius);
            bounds.include(center + radius);
        }
    }
    bounds
}

/// Whether the meshes keep 14 bits across their width when their positions are rounded in engine
/// space; further from the origin they are more accurate, if slower, as an instance.
fn keeps_shape(geometry: &Geometry<'_>, world_from_geometry: &DAffine3) -> bool {
    const MAX_DISTANCE_IN_WIDTHS: f64 = 1024.0;
    if *world_from_geometry == DAffine3::IDENTITY {
        return true;
    }
    let positions = geometry
        .meshes
        .iter()
        .filter_map(|mesh| mesh.positions.first());
    let bounds = Bounds3::from_points(
        positions
            .flat_map(|positions| positions.iter().copied().map(Vec3::from_array))
            .filter(|p| p.is_finite()),
    );
    if bounds.is_empty() {
        return true;
    }
    let center = world_from_geometry.transform_point3(bounds.center().as_dvec3());
    let half: DVec3 = 0.5 * bounds.diagonal().as_dvec3();
    let width = (world_from_geometry.matrix3 * half).length();
    center.abs().max_element() <= MAX_DISTANCE_IN_WIDTHS * width
}
