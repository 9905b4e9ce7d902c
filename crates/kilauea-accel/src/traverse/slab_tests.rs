//! How many boxes that a ray enters a slab test misses, by the distance of all from the origin:
//! naive forms miss some, the kernels must not.

#![allow(clippy::print_stdout, reason = "the table, with --nocapture")]

use super::kernel::Kernel;
use super::tree_ray::TreeRay;
use super::{Avx2, Portable};
use crate::node::Node8;
use crate::ray::Ray;
use kilauea_math::Vec3;
use kilauea_math::hash::{combine, unit_f32};

const N_RAYS: u32 = 10_000;
const OFFSETS: [f32; 9] = [0.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8];

/// Eight small boxes, and a ray that aims at a point of one of them.
fn boxes_and_ray(seed: u32, offset: f32) -> (Node8, Ray) {
    let mut key = seed << 8;
    let mut number = || {
        key += 1;
        unit_f32(combine(key, 17))
    };
    let mut point = || Vec3::new(number(), number(), number());
    let away = Vec3::new(offset, -0.6 * offset, 0.9 * offset);
    // Wide enough for `f32` to tell apart what is around.
    let ulp = offset.next_up() - offset;
    let size = (32.0 * ulp).max(1.0);
    let mut node = Node8::NONE;
    let mut target = away;
    for lane in 0..8 {
        let center = away + size * (2.0 * point() - 1.0);
        let half = (size * 10_f32.powf(-5.0 + 4.0 * point().x)).max(ulp);
        for axis in 0..3 {
            node.planes[2 * axis][lane] = center[axis] - half;
            node.planes[2 * axis + 1][lane] = center[axis] + half;
        }
        node.child[lane] = lane as u32;
        if lane as u32 == seed % 8 {
            let (low, high) = node.lane_bounds(lane);
            // Within a face, or on an edge or at a corner.
            let weights = (3.0 * point() - 1.0).clamp(Vec3::ZERO, Vec3::ONE);
            target =
                Vec3::from_array(low) + weights * (Vec3::from_array(high) - Vec3::from_array(low));
        }
    }
    let origin = away + size * (10.0 * point() - 5.0);
    (node, Ray::new(origin, target - origin))
}

/// The boxes that the ray enters, in `f64`, less those that it merely touches.
fn entered(node: &Node8, ray: &Ray) -> u32 {
    hits(node, ray, |plane, axis, is_near| {
        let t = (f64::from(plane) - f64::from(ray.origin[axis])) / f64::from(ray.dir[axis]);
        let slack = 1e-14 * t.abs();
        // Not a number where the ray runs within a plane, which trees keep clear of.
        let touches = if is_near {
            f64::INFINITY
        } else {
            f64::NEG_INFINITY
        };
        match t.is_nan() {
            true => touches,
            false if is_near => t + slack,
            false => t - slack,
        }
    })
}

/// A slab test with distances to planes by `distance(plane, axis, is_near)`.
fn hits<T: Into<f64>>(node: &Node8, ray: &Ray, distance: impl Fn(f32, usize, bool) -> T) -> u32 {
    (0..8).fold(0, |mask, lane| {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        let (low, high) = node.lane_bounds(lane);
        for axis in 0..3 {
            let (first, last) = if ray.dir[axis] < 0.0 {
                (high[axis], low[axis])
            } else {
                (low[axis], high[axis])
            };
            near = near.max(distance(first, axis, true).into());
            far = far.min(distance(last, axis, false).into());
        }
        mask | u32::from(near <= far) << lane
    })
}

fn by_kernel(kernel: impl Kernel, node: &Node8, ray: &Ray) -> u32 {
    let node_ray = kernel.node_ray(&TreeRay::world(
        (ray.origin.into(), ray.dir.into()),
        ray.t_min,
    ));
    kernel.slabs(&node_ray, f32::INFINITY, node).0
}

/// Fraction of the entered boxes that a test misses.
fn miss_rate(offset: f32, test: impl Fn(&Node8, &Ray) -> u32) -> f64 {
    let (mut n_entered, mut n_missed) = (0, 0);
    for seed in 0..N_RAYS {
        let (node, ray) = boxes_and_ray(seed, offset);
        let truth = entered(&node, &ray);
        n_entered += truth.count_ones();
        n_missed += (truth & !test(&node, &ray)).count_ones();
    }
    assert!(
        n_entered > N_RAYS / 4,
        "at {offset}: {n_entered} test little"
    );
    f64::from(n_missed) / f64::from(n_entered)
}

#[test]
fn no_kernel_misses_a_box_at_any_offset() {
    for offset in OFFSETS {
        let portable = miss_rate(offset, |node, ray| by_kernel(Portable, node, ray));
        assert_eq!(portable, 0.0, "portable at {offset:e}");
        if let Some(avx2) = Avx2::detect() {
            let avx2 = miss_rate(offset, |node, ray| by_kernel(avx2, node, ray));
            assert_eq!(avx2, 0.0, "AVX2 at {offset:e}");
        }
    }
}

/// So that the test above can fail: the usual forms do.
#[test]
fn naive_forms_miss_boxes_far_from_the_origin() {
    let with_fma = |node: &Node8, ray: &Ray| {
        let rcp = ray.dir.recip();
        hits(node, ray, |plane, axis, _| {
            plane.mul_add(rcp[axis], -(ray.origin[axis] * rcp[axis]))
        })
    };
    let by_subtraction = |node: &Node8, ray: &Ray| {
        let rcp = ray.dir.recip();
        hits(node, ray, |plane, axis, _| {
            (plane - ray.origin[axis]) * rcp[axis]
        })
    };
    for offset in OFFSETS {
        let (fma, subtraction) = (
            miss_rate(offset, with_fma),
            miss_rate(offset, by_subtraction),
        );
        println!("{offset:e}: fma {fma:.1e}, subtraction {subtraction:.1e}");
        assert!(fma > 1e-3 || offset < 1e2, "fma at {offset:e}: {fma:e}");
        // Coordinates of few digits subtract exactly; those near the origin have them all.
        assert!(
            subtraction > 1e-3 || offset > 0.0,
            "subtraction: {subtraction:e}"
        );
    }
}
