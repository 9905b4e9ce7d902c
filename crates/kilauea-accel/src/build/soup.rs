//! The still triangles of one tree, in pairs.

use super::pair::{Pair, SharedEdge};
use crate::geometry::Mesh;
use crate::visibility::Visibility;
use crate::whole::Numbered;
use kilauea_math::{DAffine3, DVec3};
use rayon::prelude::*;
use std::ops::Range;

/// Coordinates beyond this are refused: areas and edge functions must stay finite in `f32`.
pub(crate) const MAX_COORDINATE: f32 = 1e13;

/// Triangles of one mesh that are paired in one go.
const CHUNK: usize = 4096;

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

/// The meshes whose still triangles go into one tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct Soup<'a> {
    sources: Vec<Source<'a>>,
}

/// A mesh with where it goes and what hits on it report.
#[derive(Clone, Debug)]
struct Source<'a> {
    positions: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    /// Number of its first triangle in the geometry.
    first_id: u32,
    instance: u32,
    /// None where positions stay as they are.
    place: Option<DAffine3>,
}

/// Triangles of a soup by pairs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pairing {
    pub(crate) pairs: Vec<PairId>,
    /// Triangles in `pairs`.
    pub(crate) n_triangles: usize,
    /// Triangles left out: bad index, coordinate that is not finite or too large, zero area.
    pub(crate) n_rejected: usize,
}

/// Where to find the triangles of a pair: `first` and, with an edge, the one after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairId {
    source: u32,
    first: u32,
    edge: Option<SharedEdge>,
}

impl<'a> Soup<'a> {
    /// What stands still and has `visibility` of a geometry, in its own space.
    pub(crate) fn from_geometry(geometry: Numbered<'_, 'a>, visibility: Visibility) -> Self {
        let mut soup = Self::default();
        soup.add_baked((geometry, visibility), 0, &DAffine3::IDENTITY);
        soup
    }

    /// Adds what stands still and has `visibility` of a geometry in engine space, as the placement
    /// `instance`.
    pub(crate) fn add_baked(
        &mut self,
        (geometry, visibility): (Numbered<'_, 'a>, Visibility),
        instance: u32,
        world_from_geometry: &DAffine3,
    ) {
        let is_placed = *world_from_geometry != DAffine3::IDENTITY;
        for (mesh, first_id) in geometry.meshes() {
            if mesh.positions.len() <= 1 && mesh.visibility == visibility {
                self.sources.push(Source {
                    positions: first_key(mesh),
                    triangles: mesh.triangles,
                    first_id,
                    instance,
                    place: is_placed.then_some(*world_from_geometry),
                });
            }
        }
    }

    /// Pairs triangles that follow each other and share an edge.
    pub(crate) fn pairing(&self) -> Pairing {
        let chunks: Vec<(usize, Range<usize>)> = self
            .sources
            .iter()
            .enumerate()
            .flat_map(|(index, source)| {
                let n = source.triangles.len();
                let begins = (0..n).step_by(CHUNK);
                begins.map(move |begin| (index, begin..n.min(begin + CHUNK)))
            })
            .collect();
        let parts: Vec<Pairing> = chunks
            .into_par_iter()
            .map(|(index, range)| self.sources[index].pairing(index as u32, range))
            .collect();
        let mut all = Pairing::default();
        all.pairs
            .reserve_exact(parts.iter().map(|part| part.pairs.len()).sum());
        for part in parts {
            all.pairs.extend(part.pairs);
            all.n_triangles += part.n_triangles;
            all.n_rejected += part.n_rejected;
        }
        all
    }

    pub(crate) fn pair(&self, id: &PairId) -> Pair {
        let source = &self.sources[id.source as usize];
        let first = source.triangle(id.first as usize);
        match id.edge {
            None => Pair::single(&first),
            Some(edge) => Pair::across(edge, &first, &source.triangle(id.first as usize + 1)),
        }
    }
}

fn first_key<'a>(mesh: &Mesh<'a>) -> &'a [[f32; 3]] {
    mesh.positions.first().copied().unwrap_or_default()
}

impl Source<'_> {
    fn pairing(&self, source: u32, range: Range<usize>) -> Pairing {
        let mut pairing = Pairing::default();
        pairing.pairs.reserve(range.len() / 2);
        let mut add = |first: usize, edge| {
            pairing.pairs.push(PairId {
                source,
                first: first as u32,
                edge,
            });
            pairing.n_triangles += if edge.is_some() { 2 } else { 1 };
        };
        let mut open: Option<SoupTriangle> = None;
        for index in range.clone() {
            let triangle = self.triangle(index);
            let is_valid = triangle.is_valid();
            pairing.n_rejected += usize::from(!is_valid);
            let previous = open.take();
            let edge = previous
                .as_ref()
                .filter(|_| is_valid)
                .and_then(|previous| Pair::worth_joining(previous, &triangle));
            if previous.is_some() {
                add(index - 1, edge);
            }
            if is_valid && edge.is_none() {
                open = Some(triangle);
            }
        }
        if open.is_some() {
            add(range.end - 1, None);
        }
        pairing
    }

    /// Corners are NaN where there is no position.
    #[inline]
    fn triangle(&self, index: usize) -> SoupTriangle {
        let [a, b, c] = self.triangles[index];
        SoupTriangle {
            v: [self.corner(a), self.corner(b), self.corner(c)],
            triangle: self.first_id + index as u32,
            instance: self.instance,
        }
    }

    #[inline(always)]
    fn corner(&self, index: u32) -> [f32; 3] {
        let Some(&p) = self.positions.get(index as usize) else {
            return [f32::NAN; 3];
        };
        match &self.place {
            None => p,
            Some(place) => placed(place, p),
        }
    }
}

fn placed(place: &DAffine3, p: [f32; 3]) -> [f32; 3] {
    let p = DVec3::from_array(p.map(f64::from));
    place.transform_point3(p).as_vec3().to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Geometry;
    use crate::whole::FirstIds;

    /// Squares in a row, two triangles each, and one triangle without area.
    #[test]
    fn squares_become_pairs_and_bad_triangles_are_counted() {
        let n_squares = CHUNK as u32;
        let positions: Vec<[f32; 3]> = (0..2 * (n_squares + 1))
            .map(|i| [(i / 2) as f32, (i % 2) as f32, 0.0])
            .collect();
        let mut triangles: Vec<[u32; 3]> = (0..n_squares)
            .map(|i| [0, 1, 2, 3].map(|corner| 2 * i + corner))
            .flat_map(|[a, b, c, d]| [[a, c, d], [a, d, b]])
            .collect();
        triangles.push([0, 0, 1]);
        let geometry = Geometry {
            meshes: vec![Mesh::still(&positions, &triangles)],
            ..Geometry::default()
        };
        let numbered = Numbered {
            geometry: &geometry,
            first_ids: &FirstIds::of(&geometry),
        };
        let soup = Soup::from_geometry(numbered, Visibility::ALL);
        let pairing = soup.pairing();
        assert_eq!(pairing.pairs.len(), n_squares as usize);
        assert_eq!(pairing.n_triangles, 2 * n_squares as usize);
        assert_eq!(pairing.n_rejected, 1);
        assert!(pairing.pairs.iter().all(|id| !soup.pair(id).is_single()));
    }
}
