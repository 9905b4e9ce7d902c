use crate::build::{has_area, in_range};
use crate::visibility::Visibility;
use kilauea_math::DAffine3;

/// Everything one prototype holds. Primitive ids count through the triangles of its meshes, then
/// its spheres, then the segments of its curves, in order.
#[derive(Clone, Debug, Default)]
pub struct Geometry<'a> {
    /// Triangle meshes.
    pub meshes: Vec<Mesh<'a>>,
    /// Groups of spheres.
    pub spheres: Vec<Spheres<'a>>,
    /// Groups of curves.
    pub curves: Vec<Curves<'a>>,
}

/// Triangles over shared positions.
#[derive(Clone, Debug)]
pub struct Mesh<'a> {
    /// By motion key. One key stands still; several are evenly spaced over the shutter, and what
    /// lies between moves in a straight line.
    pub positions: Vec<&'a [[f32; 3]]>,
    /// Indices of the corners.
    pub triangles: &'a [[u32; 3]],
    /// Which rays meet it.
    pub visibility: Visibility,
}

impl<'a> Mesh<'a> {
    /// A mesh that stands still and that all rays meet.
    pub fn still(positions: &'a [[f32; 3]], triangles: &'a [[u32; 3]]) -> Self {
        Self {
            positions: vec![positions],
            triangles,
            visibility: Visibility::ALL,
        }
    }

    /// How many of its triangles a build leaves out, wherever the mesh is placed: those with an
    /// index or a coordinate out of range, and those without area at every key.
    pub fn n_degenerate(&self) -> usize {
        let corners = self.triangles.iter();
        corners
            .filter(|corners| self.is_degenerate(corners))
            .count()
    }

    fn is_degenerate(&self, corners: &[u32; 3]) -> bool {
        let mut any_area = false;
        for positions in &self.positions {
            let at = |i: u32| positions.get(i as usize).filter(|p| in_range(p)).copied();
            let [Some(a), Some(b), Some(c)] = corners.map(at) else {
                return true;
            };
            any_area |= has_area(&[a, b, c]);
        }
        !any_area
    }
}

/// Spheres of constant radius.
#[derive(Clone, Debug)]
pub struct Spheres<'a> {
    /// By motion key, as in [`Mesh::positions`].
    pub centers: Vec<&'a [[f32; 3]]>,
    /// By sphere.
    pub radii: &'a [f32],
    /// Which rays meet them.
    pub visibility: Visibility,
}

/// What lies between the control points of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveBasis {
    /// Two control points: a straight line.
    Linear,
    /// Four: a cubic Bézier curve.
    Bezier,
}

/// What is swept along a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveProfile {
    /// Balls: ends are half spheres, and joints have no gaps.
    Round,
    /// A flat strip that faces the ray or, with normals, lies across them. Cubic strips have flat
    /// ends; straight ones that face the ray end in half discs, which closes joints.
    Ribbon,
}

/// Segments of curves.
#[derive(Clone, Debug)]
pub struct Curves<'a> {
    /// Control points by motion key, as in [`Mesh::positions`].
    pub points: Vec<&'a [[f32; 3]]>,
    /// By control point; half of USD's widths.
    pub radii: &'a [f32],
    /// By control point; makes oriented ribbons, and is ignored for round curves.
    pub normals: Option<&'a [[f32; 3]]>,
    /// The first control point of each segment.
    pub segments: &'a [u32],
    /// What lies between control points.
    pub basis: CurveBasis,
    /// What is swept along.
    pub profile: CurveProfile,
    /// Which rays meet them.
    pub visibility: Visibility,
}

/// A geometry put into the engine's space.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Index into the geometries.
    pub geometry: u32,
    /// Takes positions of the geometry to engine space; may mirror.
    pub world_from_geometry: DAffine3,
    /// By key, evenly spaced over the shutter: takes positions to engine space instead of
    /// `world_from_geometry`, with matrices interpolated linearly between keys.
    pub motion: Option<Box<[DAffine3]>>,
    /// Which rays meet it, of those that meet its parts.
    pub visibility: Visibility,
}

impl Placement {
    /// A placement that stands still and that all rays meet.
    pub fn still(geometry: u32, world_from_geometry: DAffine3) -> Self {
        Self {
            geometry,
            world_from_geometry,
            motion: None,
            visibility: Visibility::ALL,
        }
    }

    /// The matrices by key: at least one.
    pub(crate) fn keys(&self) -> &[DAffine3] {
        match &self.motion {
            Some(keys) if !keys.is_empty() => keys,
            _ => std::slice::from_ref(&self.world_from_geometry),
        }
    }
}

/// Choices of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// Whether vector instructions may be used where the processor has them. The hits are the
    /// same either way.
    pub simd: bool,
    /// Whether rays skip the code for what the scene does not have: instances, motion, other
    /// primitives than triangles, visibility. The hits are the same either way.
    pub specialize: bool,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            simd: true,
            specialize: true,
        }
    }
}
