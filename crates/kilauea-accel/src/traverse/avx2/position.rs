//! Where a ray meets a triangle, found for the three corners at once in `f64`.

use std::arch::x86_64::{
    __m256d, _CMP_NEQ_OQ, _mm_cvtsd_f64, _mm_setr_ps, _mm_unpackhi_pd, _mm256_broadcast_sd,
    _mm256_castpd256_pd128, _mm256_cmp_pd, _mm256_cvtps_pd, _mm256_extractf128_pd,
    _mm256_movemask_pd, _mm256_mul_pd, _mm256_permute4x64_pd, _mm256_setzero_pd, _mm256_sub_pd,
};

use crate::node::{LeafTriangle, PairLeaf};
use crate::traverse::tree_ray::TreeRay;
use crate::traverse::triangle;

/// As [`triangle::intersect`], to the bit. The corners lie in the lanes of one vector, with the first
/// once more in the last.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
pub(super) unsafe fn position(ray: &TreeRay, leaf: &PairLeaf, lane: usize) -> Option<[f32; 3]> {
    let triangle = leaf.lane(lane);
    let [kx, ky, kz] = ray.axes();
    // SAFETY: as the caller promises.
    let (weights, along, is_inside) = unsafe {
        let along = corners_f64(ray, &triangle, kz);
        let x = sheared_f64(ray, corners_f64(ray, &triangle, kx), along, [kx, kz]);
        let y = sheared_f64(ray, corners_f64(ray, &triangle, ky), along, [ky, kz]);
        let weights = _mm256_sub_pd(
            _mm256_mul_pd(before(x), after(y)),
            _mm256_mul_pd(before(y), after(x)),
        );
        let signs = _mm256_movemask_pd(weights);
        let nonzero = _mm256_cmp_pd::<_CMP_NEQ_OQ>(weights, _mm256_setzero_pd());
        // None of the three, or all: no branch, since any ray may see either side.
        let alike = (signs + 1) & 7 <= 1;
        (
            first_three(weights),
            first_three(_mm256_mul_pd(weights, along)),
            alike && _mm256_movemask_pd(nonzero) & 7 == 7,
        )
    };
    if !is_inside {
        return intersect_at_border(leaf, lane, ray);
    }
    Some(triangle::weighted_mean(weights, along, ray.dir_f64[kz]))
}

/// A coordinate of the three corners, from the origin.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn corners_f64(ray: &TreeRay, triangle: &LeafTriangle<'_>, axis: usize) -> __m256d {
    let a = triangle.coordinate(0, axis);
    let b = triangle.coordinate(1, axis);
    let c = triangle.coordinate(2, axis);
    // SAFETY: as the caller promises.
    unsafe {
        let origin = _mm256_broadcast_sd(&ray.origin_f64[axis]);
        _mm256_sub_pd(_mm256_cvtps_pd(_mm_setr_ps(a, b, c, a)), origin)
    }
}

/// As in [`triangle::intersect`]: a coordinate of the corners in the plane across the ray, times the
/// largest component of the direction; `axes` are that coordinate's and the largest one's.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn sheared_f64(
    ray: &TreeRay,
    corners: __m256d,
    along: __m256d,
    axes: [usize; 2],
) -> __m256d {
    // SAFETY: as the caller promises.
    unsafe {
        let dir = _mm256_broadcast_sd(&ray.dir_f64[axes[0]]);
        let dir_largest = _mm256_broadcast_sd(&ray.dir_f64[axes[1]]);
        _mm256_sub_pd(
            _mm256_mul_pd(corners, dir_largest),
            _mm256_mul_pd(dir, along),
        )
    }
}

/// The corner before each: c, a, b.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn before(corners: __m256d) -> __m256d {
    // SAFETY: as the caller promises.
    unsafe { _mm256_permute4x64_pd::<0b10_01_00_10>(corners) }
}

/// The corner after each: b, c, a.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn after(corners: __m256d) -> __m256d {
    // SAFETY: as the caller promises.
    unsafe { _mm256_permute4x64_pd::<0b01_00_10_01>(corners) }
}

/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn first_three(x: __m256d) -> [f64; 3] {
    // SAFETY: as the caller promises.
    unsafe {
        let low = _mm256_castpd256_pd128(x);
        [
            _mm_cvtsd_f64(low),
            _mm_cvtsd_f64(_mm_unpackhi_pd(low, low)),
            _mm_cvtsd_f64(_mm256_extractf128_pd::<1>(x)),
        ]
    }
}

/// A line through an edge or a corner, as far as `f64` can tell.
#[cold]
#[inline(never)]
fn intersect_at_border(leaf: &PairLeaf, lane: usize, ray: &TreeRay) -> Option<[f32; 3]> {
    triangle::intersect(&leaf.lane(lane), ray)
}
