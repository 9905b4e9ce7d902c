//! Where a ray meets a triangle, found for the three corners at once in `f64`.

use std::arch::x86_64::{
    __m256d, _CMP_NEQ_OQ, _mm_add_pd, _mm_cvtpd_ps, _mm_cvtsd_f64, _mm_cvtss_f32, _mm_hadd_pd,
    _mm_movehdup_ps, _mm_mul_pd, _mm_set1_pd, _mm_setr_ps, _mm_shuffle_pd, _mm_unpackhi_pd,
    _mm_unpacklo_pd, _mm256_castpd256_pd128, _mm256_cmp_pd, _mm256_cvtps_pd, _mm256_extractf128_pd,
    _mm256_movemask_pd, _mm256_mul_pd, _mm256_permute4x64_pd, _mm256_set1_pd, _mm256_setzero_pd,
    _mm256_sub_pd,
};

use super::x86::LeafRay;
use crate::node::PairLeaf;
use crate::traverse::tree_ray::{Line, TreeRay};
use crate::traverse::triangle;

/// As [`triangle::intersect`], to the bit. The corners lie in the lanes of one vector, with the first
/// once more in the last.
///
/// # Safety
/// Needs AVX2 and a lane of the leaf.
#[inline(always)]
pub(super) unsafe fn position<L: Line>(
    ray: &TreeRay<L>,
    leaf_ray: &LeafRay,
    leaf: &PairLeaf,
    lane: usize,
) -> Option<[f32; 3]> {
    let exact = Exact::new(ray, leaf_ray);
    // SAFETY: as the caller promises.
    unsafe {
        let along = exact.corners(leaf, lane, 2);
        let x = exact.sheared(exact.corners(leaf, lane, 0), along, 0);
        let y = exact.sheared(exact.corners(leaf, lane, 1), along, 1);
        let weights = _mm256_sub_pd(
            _mm256_mul_pd(before(x), after(y)),
            _mm256_mul_pd(before(y), after(x)),
        );
        let signs = _mm256_movemask_pd(weights);
        let nonzero = _mm256_cmp_pd::<_CMP_NEQ_OQ>(weights, _mm256_setzero_pd());
        // None of the three, or all: no branch, since any ray may see either side.
        let alike = (signs + 1) & 7 <= 1;
        if !(alike && _mm256_movemask_pd(nonzero) & 7 == 7) {
            return intersect_at_border(leaf, lane, *ray);
        }
        let weighted_along = _mm256_mul_pd(weights, along);
        Some(weighted_mean(weights, weighted_along, exact.dir[2]))
    }
}

/// The exact line, by axis as sheared: that of the largest component of the direction last.
struct Exact {
    origin: [f64; 3],
    dir: [f64; 3],
    /// Where the coordinates of an axis begin in a leaf.
    axis_offset: [usize; 3],
}

impl Exact {
    #[inline(always)]
    fn new<L: Line>(ray: &TreeRay<L>, leaf_ray: &LeafRay) -> Self {
        let ([x, y, z], line) = (ray.axes(), &ray.line);
        let (origin, dir) = (&leaf_ray.origin, &leaf_ray.dir);
        Self {
            origin: [
                line.origin(x, origin[0]),
                line.origin(y, origin[1]),
                line.origin(z, origin[2]),
            ],
            dir: [
                line.dir(x, dir[0]),
                line.dir(y, dir[1]),
                line.dir(z, dir[2]),
            ],
            axis_offset: *leaf_ray.axis_offset,
        }
    }

    /// A coordinate of the three corners, from the origin.
    ///
    /// # Safety
    /// Needs AVX2 and offsets of axes.
    #[inline(always)]
    unsafe fn corners(&self, leaf: &PairLeaf, lane: usize, axis: usize) -> __m256d {
        /// Coordinates of a corner.
        const ROW: usize = 4;
        let [a, b, c] = leaf.corner_rows(lane);
        let pair = self.axis_offset[axis] + (lane & 3);
        let coordinates = leaf.corners.as_ptr().cast::<f32>();
        // SAFETY: as the caller promises; there are four rows for each axis.
        unsafe {
            let a = *coordinates.add(pair + ROW * usize::from(a));
            let b = *coordinates.add(pair + ROW * usize::from(b));
            let c = *coordinates.add(pair + ROW * usize::from(c));
            let corners = _mm256_cvtps_pd(_mm_setr_ps(a, b, c, a));
            _mm256_sub_pd(corners, _mm256_set1_pd(self.origin[axis]))
        }
    }

    /// As in [`triangle::intersect`]: a coordinate of the corners in the plane across the ray, times
    /// the largest component of the direction.
    ///
    /// # Safety
    /// Needs AVX2.
    #[inline(always)]
    unsafe fn sheared(&self, corners: __m256d, along: __m256d, axis: usize) -> __m256d {
        // SAFETY: as the caller promises.
        unsafe {
            _mm256_sub_pd(
                _mm256_mul_pd(corners, _mm256_set1_pd(self.dir[2])),
                _mm256_mul_pd(_mm256_set1_pd(self.dir[axis]), along),
            )
        }
    }
}

/// As [`triangle::weighted_mean`], to the bit.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn weighted_mean(weights: __m256d, along: __m256d, dir_largest: f64) -> [f32; 3] {
    // SAFETY: as the caller promises.
    unsafe {
        let weights_ab = _mm256_castpd256_pd128(weights);
        let weights_c = _mm256_extractf128_pd::<1>(weights);
        let along_ab = _mm256_castpd256_pd128(along);
        let along_c = _mm256_extractf128_pd::<1>(along);
        let sums = _mm_add_pd(
            _mm_hadd_pd(weights_ab, along_ab),
            _mm_unpacklo_pd(weights_c, along_c),
        );
        let scale = 1.0 / (_mm_cvtsd_f64(sums) * dir_largest);
        let t = _mm_cvtsd_f64(_mm_unpackhi_pd(sums, sums)) * scale;
        let weights_bc = _mm_shuffle_pd::<0b01>(weights_ab, weights_c);
        let scaled = _mm_mul_pd(
            _mm_mul_pd(weights_bc, _mm_set1_pd(dir_largest)),
            _mm_set1_pd(scale),
        );
        let uv = _mm_cvtpd_ps(scaled);
        [
            t as f32,
            _mm_cvtss_f32(uv),
            _mm_cvtss_f32(_mm_movehdup_ps(uv)),
        ]
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

/// A line through an edge or a corner, as far as `f64` can tell. The ray goes by value, so that it
/// need not lie in memory before.
#[cold]
#[inline(never)]
fn intersect_at_border<L: Line>(leaf: &PairLeaf, lane: usize, ray: TreeRay<L>) -> Option<[f32; 3]> {
    triangle::intersect(&leaf.lane(lane), &ray)
}
