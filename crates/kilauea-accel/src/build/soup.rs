use super::pair::Pair;
use crate::geometry::Geometry;
use crate::visibility::Visibility;
use kilauea_math::{DAffine3, DVec3};

/// Coordinates beyond this are refused: areas and edge functions must stay finite in `f32`.
pub(crate) const MAX_COORDINATE: f32 = 1e13;

/// A triangle with the ids a hit on it reports.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SoupTriangle {
    pub(crate) v: [[f32; 3]; 3],
    pub(crate) triangle: u32,
    pub(crate) instance: u32,
}

impl SoupTriangle {
    /// In range, and not so thin that its area is zero.
    fn is_valid(&self) -> bool {
        self.v.iter().all(in_range) && has_area(&self.v)
    }
}

/// Whether a position is one of numbers that are not too large.
pub(crate) fn in_range(p: &[f32; 3]) -> bool {
    p.iter().all(|x| x.abs() <= MAX_COORDINATE)
}

/// Whether a triangle is not so thin that its area is zero.
pub(crate) fn has_area(v: &[[f32; 3]; 3]) -> bool {
    let [a, b, c] = v.map(|p| DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a) != DVec3::ZERO
}

/// The valid still triangles of one tree, in pairs where neighbours in the mesh share an edge.
#[derive(Clone, Debug, Default)]
pub(crate) struct Soup {
    pub(crate) pairs: Vec<Pair>,
    /// Triangles in `pairs`.
    pub(crate) n_triangles: usize,
    /// Triangles left out: bad index, coordinate that is not finite or too large, zero area.
    pub(crate) n_rejected: usize,
}

impl Soup {
    /// What stands still and has `visibility` of a geometry, in its own space.
    pub(crate) fn from_geometry(geometry: &Geometry<'_>, visibility: Visibility) -> Self {
        let mut soup = Self::default();
        soup.add_with(geometry, visibility, 0, |p| p);
        soup
    }

    /// Adds what stands still and has `visibility` of a geometry in engine space, as the placement
    /// `instance`.
    pub(crate) fn add_baked(
        &mut self,
        (geometry, visibility): (&Geometry<'_>, Visibility),
        instance: u32,
        world_from_geometry: &DAffine3,
    ) {
        if *world_from_geometry == DAffine3::IDENTITY {
            return self.add_with(geometry, visibility, instance, |p| p);
        }
        self.add_with(geometry, visibility, instance, |p| {
            let p = DVec3::from_array(p.map(f64::from));
            world_from_geometry.transform_point3(p).as_vec3().to_array()
        });
    }

    fn add_with(
        &mut self,
        geometry: &Geometry<'_>,
        visibility: Visibility,
        instance: u32,
        place: impl Fn([f32; 3]) -> [f32; 3],
    ) {
        let mut triangle = 0;
        for mesh in &geometry.meshes {
            if mesh.positions.len() > 1 || mesh.visibility != visibility {
                triangle += mesh.triangles.len() as u32;
                continue;
            }
            let positions = mesh.positions.first().copied().unwrap_or_default();
            self.pairs.reserve(mesh.triangles.len() / 2);
            let mut open = None;
            for corners in mesh.triangles {
                let v = corners.map(|i| positions.get(i as usize).copied());
                let candidate = SoupTriangle {
                    v: v.map(|p| place(p.unwrap_or([f32::NAN; 3]))),
                    triangle,
                    instance,
                };
                if candidate.is_valid() {
                    self.n_triangles += 1;
                    open = match open {
                        None => Some(candidate),
                        Some(previous) => self.add_after(previous, candidate),
                    };
                } else {
                    self.n_rejected += 1;
                }
                triangle += 1;
            }
            self.pairs.extend(open.map(|last| Pair::single(&last)));
        }
    }

    /// Adds `previous`, together with `next` if they make a pair; otherwise `next` stays open.
    fn add_after(&mut self, previous: SoupTriangle, next: SoupTriangle) -> Option<SoupTriangle> {
        if let Some(pair) = Pair::joined(&previous, &next) {
            self.pairs.push(pair);
            return None;
        }
        self.pairs.push(Pair::single(&previous));
        Some(next)
    }
}
