//! Triangles with a common edge go to the leaves together: most meshes come from quads.

use super::soup::SoupTriangle;
use crate::node::PairLeaf;
use kilauea_math::Vec3A;
use obvhs::aabb::Aabb;

/// Triangles (a, b, c) and (a, c, d) with the ids that hits on them report, or the first alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Corners a to d; without a second triangle, d repeats c.
    corners: [[f32; 3]; 4],
    /// `u32::MAX` where there is no second triangle.
    triangle: [u32; 2],
    instance: u32,
    /// See [`PairLeaf::order`].
    order: [u8; 2],
}

/// The edge between two triangles, which the second passes the other way round, as in every
/// oriented mesh: from corner `first` of the first on, and towards corner `second + 1` of the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SharedEdge {
    first: u8,
    second: u8,
}

impl SharedEdge {
    fn between(p: &[[f32; 3]; 3], q: &[[f32; 3]; 3]) -> Option<Self> {
        let (i, j) = (0..9)
            .map(|k| (k / 3, k % 3))
            .find(|&(i, j)| p[i] == q[(j + 1) % 3] && p[(i + 1) % 3] == q[j])?;
        Some(Self {
            first: i as u8,
            second: j as u8,
        })
    }
}

impl Pair {
    pub(crate) fn single(triangle: &SoupTriangle) -> Self {
        let [a, b, c] = triangle.v;
        Self {
            corners: [a, b, c, c],
            triangle: [triangle.triangle, u32::MAX],
            instance: triangle.instance,
            order: [0, 3],
        }
    }

    /// The edge that two triangles share, if a common box is no larger than the two.
    pub(crate) fn worth_joining(first: &SoupTriangle, second: &SoupTriangle) -> Option<SharedEdge> {
        let edge = SharedEdge::between(&first.v, &second.v)?;
        let areas = [first, second].map(|triangle| bounds_of(&triangle.v).half_area());
        let both = bounds_of(&first.v).union(&bounds_of(&second.v));
        (both.half_area() <= areas[0] + areas[1]).then_some(edge)
    }

    /// Two triangles that share an edge.
    pub(crate) fn across(edge: SharedEdge, first: &SoupTriangle, second: &SoupTriangle) -> Self {
        let [i, j] = [edge.first, edge.second].map(usize::from);
        let (p, q) = (first.v, second.v);
        Self {
            corners: [p[(i + 1) % 3], p[(i + 2) % 3], p[i], q[(j + 2) % 3]],
            triangle: [first.triangle, second.triangle],
            instance: first.instance,
            order: [(2 - edge.first) % 3, (3 - edge.second) % 3 + 3],
        }
    }

    /// The pairs at both ends of an interval between motion keys, if the triangles share the same
    /// edge at both.
    pub(crate) fn joined_alike(
        first: &[SoupTriangle; 2],
        second: &[SoupTriangle; 2],
    ) -> Option<[Self; 2]> {
        let [begin, end] = [0, 1].map(|key| Self::worth_joining(&first[key], &second[key]));
        let edge = begin.filter(|_| begin == end)?;
        Some([0, 1].map(|key| Self::across(edge, &first[key], &second[key])))
    }

    pub(crate) fn bounds(&self) -> Aabb {
        bounds_of(&self.corners)
    }

    /// A box around all that the triangle test may take for the pair.
    ///
    /// Lines that pass between two triangles are given to one of them by edge functions whose
    /// corners are rounded. Errors in proportion to the distance from the ray's origin are covered
    /// by the slack of the reciprocal direction in the box test, those in proportion to the edges
    /// by this.
    pub(crate) fn bounds_with_border(&self) -> Aabb {
        let border = Vec3A::splat(4.0 * f32::EPSILON * self.longest_edge());
        let bounds = self.bounds();
        Aabb::new(bounds.min - border, bounds.max + border)
    }

    pub(crate) fn is_single(&self) -> bool {
        self.triangle[1] == u32::MAX
    }

    pub(crate) fn longest_edge(&self) -> f32 {
        let [a, b, c, d] = self.corners.map(Vec3A::from_array);
        [(a, b), (b, c), (c, a), (c, d), (d, a)]
            .into_iter()
            .map(|(from, to)| from.distance_squared(to))
            .fold(0.0, f32::max)
            .sqrt()
    }

    /// Writes the pair into a lane of `leaf`.
    pub(crate) fn store(&self, leaf: &mut PairLeaf, lane: usize) {
        let n_corners = if self.is_single() { 3 } else { 4 };
        for (corner, p) in self.corners.iter().enumerate().take(n_corners) {
            for (axis, coordinate) in p.iter().enumerate() {
                leaf.corners[axis][corner][lane] = *coordinate;
            }
        }
        for half in 0..2 {
            leaf.triangle[lane + 4 * half] = self.triangle[half];
            leaf.order[lane + 4 * half] = self.order[half];
        }
        leaf.instance[lane] = self.instance;
    }
}

fn bounds_of(points: &[[f32; 3]]) -> Aabb {
    points.iter().fold(Aabb::INVALID, |bounds, &p| {
        let p = Vec3A::from_array(p);
        Aabb::new(bounds.min.min(p), bounds.max.max(p))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f32; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];

    fn triangle(corners: [usize; 3], id: u32) -> SoupTriangle {
        SoupTriangle {
            v: corners.map(|i| SQUARE[i]),
            triangle: id,
            instance: 3,
        }
    }

    #[test]
    fn however_the_corners_are_numbered_they_come_back() {
        for turn in 0..9 {
            let turned = |corners: [usize; 3], by: usize| [0, 1, 2].map(|i| corners[(i + by) % 3]);
            let first = triangle(turned([0, 1, 2], turn / 3), 4);
            let second = triangle(turned([2, 3, 0], turn % 3), 5);
            let edge = Pair::worth_joining(&first, &second).expect("a shared edge");
            let pair = Pair::across(edge, &first, &second);
            let mut leaf = PairLeaf::NONE;
            pair.store(&mut leaf, 2);
            assert_eq!(leaf.lane(2).corners(), first.v);
            assert_eq!(leaf.lane(6).corners(), second.v);
            assert_eq!(leaf.used_lanes().collect::<Vec<_>>(), [2, 6]);
            assert_eq!((leaf.triangle[2], leaf.triangle[6]), (4, 5));
        }
    }

    #[test]
    fn triangles_without_a_common_edge_stay_apart() {
        let first = triangle([0, 1, 2], 0);
        let mut apart = triangle([2, 3, 0], 1);
        apart.v[0][2] += 1e-7;
        assert!(Pair::worth_joining(&first, &apart).is_none());
        let flipped = triangle([0, 3, 2], 1);
        assert!(Pair::worth_joining(&first, &flipped).is_none());
    }
}
