//! Binary trees by `obvhs`.

use super::soup::SoupTriangle;
use crate::geometry::Quality;
use kilauea_math::Vec3A;
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::splits::split_aabbs_preset;
use obvhs::triangle::Triangle;

/// One triangle (or a part of a large one, in final quality) to a leaf.
pub(crate) fn over_triangles(triangles: &[SoupTriangle], quality: Quality) -> Bvh2 {
    let (mut boxes, indices) = match quality {
        Quality::Preview => {
            let boxes = triangles.iter().map(SoupTriangle::bounds).collect();
            (boxes, all(triangles.len()))
        }
        Quality::Final => presplit(triangles),
    };
    for (bounds, &index) in boxes.iter_mut().zip(&indices) {
        *bounds = with_border(bounds, &triangles[index as usize]);
    }
    over_boxes(&boxes, indices, quality)
}

/// A box around all that the triangle test may take for the triangle.
///
/// Lines that pass between two triangles are given to one of them by edge functions whose corners
/// are rounded. Errors in proportion to the distance from the ray's origin are covered by the
/// slack of the reciprocal direction in the box test, those in proportion to the edges by this.
/// Were the box any tighter, a line given to this triangle could pass its box, and leak.
fn with_border(bounds: &Aabb, triangle: &SoupTriangle) -> Aabb {
    let border = Vec3A::splat(4.0 * f32::EPSILON * triangle.longest_edge());
    Aabb::new(bounds.min - border, bounds.max + border)
}

/// One primitive to a leaf; `indices` names the primitive of each box.
pub(crate) fn over_boxes<T: Boundable>(boxes: &[T], indices: Vec<u32>, quality: Quality) -> Bvh2 {
    let (search, first_depth, precision, reinsertion) = match quality {
        Quality::Preview => (PlocSearchDistance::Medium, 3, SortPrecision::U64, 0.05),
        Quality::Final => (PlocSearchDistance::Medium, 1, SortPrecision::U128, 1.0),
    };
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        search,
        boxes,
        indices,
        precision,
        first_depth,
    );
    ReinsertionOptimizer::default().run(&mut bvh, reinsertion, None);
    bvh
}

/// The numbers below `n`.
pub(crate) fn all(n: usize) -> Vec<u32> {
    (0..n as u32).collect()
}

/// Boxes around the triangles, several for each one much larger than most.
fn presplit(triangles: &[SoupTriangle]) -> (Vec<Aabb>, Vec<u32>) {
    let mut boxes: Vec<Aabb> = triangles.iter().map(SoupTriangle::bounds).collect();
    let mut indices = all(boxes.len());
    let corners: Vec<Triangle> = triangles
        .iter()
        .map(|t| {
            let [v0, v1, v2] = t.v.map(Vec3A::from_array);
            Triangle { v0, v1, v2 }
        })
        .collect();
    let areas = || boxes.iter().map(Aabb::half_area);
    let mean = areas().sum::<f32>() / boxes.len().max(1) as f32;
    let largest = areas().fold(0.0, f32::max);
    split_aabbs_preset(&mut boxes, &mut indices, &corners, mean, largest);
    (boxes, indices)
}
