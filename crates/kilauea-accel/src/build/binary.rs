//! Binary trees by `obvhs`.

use super::pair::Pair;
use crate::geometry::Quality;
use kilauea_math::Vec3A;
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::splits::split_aabbs_preset;
use obvhs::triangle::Triangle;

/// Times the mean area from which `obvhs` considers a box for splitting.
const LEAST_TO_SPLIT: f32 = 3.0;

/// One pair (or a part of a large one, in final quality) to a leaf.
pub(crate) fn over_pairs(pairs: &[Pair], quality: Quality) -> Bvh2 {
    match quality {
        Quality::Preview => {
            let boxes: Vec<Aabb> = pairs.iter().map(Pair::bounds_with_border).collect();
            over_boxes(&boxes, quality)
        }
        Quality::Final => {
            let (mut boxes, pair_of_box) = presplit(pairs);
            for (bounds, &pair) in boxes.iter_mut().zip(&pair_of_box) {
                *bounds = pairs[pair as usize].with_border(bounds);
            }
            let mut bvh = over_boxes(&boxes, quality);
            for index in &mut bvh.primitive_indices {
                *index = pair_of_box[*index as usize];
            }
            bvh
        }
    }
}

/// One box to a leaf.
pub(crate) fn over_boxes<T: Boundable>(boxes: &[T], quality: Quality) -> Bvh2 {
    let (search, first_depth, precision, reinsertion) = match quality {
        Quality::Preview => (PlocSearchDistance::Medium, 3, SortPrecision::U64, 0.05),
        Quality::Final => (PlocSearchDistance::Medium, 1, SortPrecision::U128, 1.0),
    };
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        search,
        boxes,
        (0..boxes.len() as u32).collect(),
        precision,
        first_depth,
    );
    ReinsertionOptimizer::default().run(&mut bvh, reinsertion, None);
    bvh
}

/// Boxes around the pairs, several for each one much larger than most, and whose they are.
fn presplit(pairs: &[Pair]) -> (Vec<Aabb>, Vec<u32>) {
    let mut boxes = Vec::with_capacity(pairs.len());
    // Until the end these count triangles: boxes of a pair name its first.
    let mut indices = Vec::with_capacity(pairs.len());
    let areas = || pairs.iter().map(|pair| pair.bounds().half_area());
    let mean = areas().sum::<f32>() / pairs.len().max(1) as f32;
    let largest = areas().fold(0.0, f32::max);
    let triangles: Vec<Triangle> = pairs
        .iter()
        .flat_map(Pair::triangles)
        .map(|corners| {
            let [v0, v1, v2] = corners.map(Vec3A::from_array);
            Triangle { v0, v1, v2 }
        })
        .collect();
    for (i, pair) in pairs.iter().enumerate() {
        let first = 2 * i as u32;
        let bounds = pair.bounds();
        if pair.is_single() || bounds.half_area() <= mean * LEAST_TO_SPLIT {
            boxes.push(bounds);
            indices.push(first);
        } else {
            for triangle in [first, first + 1] {
                boxes.push(triangles[triangle as usize].aabb());
                indices.push(triangle);
            }
        }
    }
    split_aabbs_preset(&mut boxes, &mut indices, &triangles, mean, largest);
    for index in &mut indices {
        *index /= 2;
    }
    (boxes, indices)
}
