use std::borrow::Cow;

use kilauea_math::{DAffine3, DVec3, Vec3};

use crate::channel::Channel;
use crate::report::Report;

/// Corners of each face.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FaceSizes<'a> {
    /// The same for all faces.
    All(usize),
    /// One non-negative count per face.
    Each(&'a [i32]),
}

impl FaceSizes<'_> {
    pub(crate) fn n_faces(&self, n_corners: usize) -> usize {
        match *self {
            Self::All(size) => n_corners / size,
            Self::Each(counts) => counts.len(),
        }
    }

    #[inline]
    pub(crate) fn size(&self, face: usize) -> usize {
        match *self {
            Self::All(size) => size,
            Self::Each(counts) => counts[face] as usize,
        }
    }
}

/// A polygon mesh whose indices are all in range, whatever it came from.
pub(crate) struct Surface<'a> {
    pub(crate) points: Cow<'a, [[f32; 3]]>,
    /// Point of each corner, face after face.
    pub(crate) corner_points: Cow<'a, [u32]>,
    pub(crate) sizes: FaceSizes<'a>,
    /// The mesh face that each face is part of, where it is not the face itself.
    pub(crate) source_faces: Option<Vec<u32>>,
    /// What is drawn with which material.
    pub(crate) parts: Parts,
    /// Unit normals that point outward; faceted when absent.
    pub(crate) normals: Option<Channel<'a>>,
    pub(crate) channels: Vec<Channel<'a>>,
    /// From the points' space to the space of the prototype that holds the surface.
    pub(crate) prototype_from_points: DAffine3,
    /// Whether faces are wound clockwise as seen from the outside.
    pub(crate) left_handed: bool,
    /// Whether some points are not [`is_placeable`].
    pub(crate) has_bad_points: bool,
    /// Triangles that were left out on the way here, because of such points.
    pub(crate) n_dropped: usize,
    /// The surface at the motion keys after the first.
    pub(crate) later_keys: Vec<SurfaceKey<'a>>,
}

/// What of a [`Surface`] moves.
pub(crate) struct SurfaceKey<'a> {
    /// As many as the surface has.
    pub(crate) points: Cow<'a, [[f32; 3]]>,
    /// Laid out as the surface's normals, and present where these are.
    pub(crate) normals: Option<Channel<'a>>,
    pub(crate) prototype_from_points: DAffine3,
}

/// Which faces go where.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parts {
    /// Material of each part.
    pub(crate) materials: Vec<u32>,
    /// Part of each source face, or [`Parts::HOLE`]; all in part 0 when absent.
    pub(crate) of_face: Option<Vec<u32>>,
}

impl Parts {
    /// The part of faces that are not drawn.
    pub(crate) const HOLE: u32 = u32::MAX;

    #[inline]
    pub(crate) fn part(&self, source_face: u32) -> u32 {
        self.of_face
            .as_ref()
            .map_or(0, |of_face| of_face[source_face as usize])
    }
}

/// Whether a point of prototype space is finite, and stays so in `f32`.
pub(crate) fn is_placeable(p: DVec3) -> bool {
    const FARTHEST: f64 = 1e30;
    p.abs().cmple(DVec3::splat(FARTHEST)).all()
}

/// How much a transform enlarges in the mean, for radii.
pub(crate) fn mean_scale(path: &str, transform: &DAffine3, report: &mut Report) -> f32 {
    let m = transform.matrix3;
    let scales = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
    let (least, most) = scales
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(a, b), &s| (a.min(s), b.max(s)));
    if most > 1.01 * least {
        report.warn(path, "transform", "scales unevenly; widths by the mean");
    }
    m.determinant().abs().cbrt() as f32
}

/// A triangle of a [`Surface`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    /// Counter-clockwise as seen from the outside.
    pub(crate) corners: [u32; 3],
    /// Source face.
    pub(crate) face: u32,
}

/// The triangles of each part, and how many were dropped because of bad points.
pub(crate) fn triangles_of_parts(surface: &Surface<'_>) -> (Vec<Vec<Triangle>>, usize) {
    let n_corners = surface.corner_points.len();
    let n_faces = surface.sizes.n_faces(n_corners);
    let mut parts = vec![Vec::new(); surface.parts.materials.len()];
    if let [only] = &mut parts[..] {
        only.reserve_exact(n_corners.saturating_sub(2 * n_faces));
    }
    let flip = surface.left_handed != (surface.prototype_from_points.matrix3.determinant() < 0.0);
    let mut triangulator = crate::triangulate::Triangulator::default();
    let mut corner_points = Vec::new();
    let mut n_dropped = surface.n_dropped;
    let mut first = 0;
    for face in 0..n_faces {
        let size = surface.sizes.size(face);
        let corners = first..first + size;
        first += size;
        let source = surface
            .source_faces
            .as_ref()
            .map_or(face as u32, |source| source[face]);
        let part = surface.parts.part(source);
        if size < 3 || part == Parts::HOLE {
            continue;
        }
        corner_points.clear();
        corner_points.extend(
            surface.corner_points[corners.clone()]
                .iter()
                .map(|&p| Vec3::from_array(surface.points[p as usize])),
        );
        if surface.has_bad_points {
            let to_prototype = &surface.prototype_from_points;
            let good = |p: &Vec3| {
                let p = p.as_dvec3();
                is_placeable(p) && is_placeable(to_prototype.transform_point3(p))
            };
            if !corner_points.iter().all(good) {
                n_dropped += size - 2;
                continue;
            }
        }
        for local in triangulator.triangulate(&corner_points) {
            let [a, b, c] = local.map(|i| corners.start as u32 + i);
            parts[part as usize].push(Triangle {
                corners: if flip { [a, c, b] } else { [a, b, c] },
                face: source,
            });
        }
    }
    (parts, n_dropped)
}
