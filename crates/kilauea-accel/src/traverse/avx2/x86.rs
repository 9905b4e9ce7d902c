use std::arch::is_x86_feature_detected;
use std::arch::x86_64::{
    __m256, _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _MM_HINT_T0, _mm_load_ps,
    _mm_loadl_epi64, _mm_prefetch, _mm256_add_ps, _mm256_and_ps, _mm256_andnot_ps,
    _mm256_broadcast_ps, _mm256_cmp_ps, _mm256_cvtepu8_epi32, _mm256_div_ps, _mm256_fmadd_ps,
    _mm256_load_ps, _mm256_loadu_ps, _mm256_loadu_si256, _mm256_max_ps, _mm256_min_ps,
    _mm256_movemask_ps, _mm256_mul_ps, _mm256_or_ps, _mm256_permutevar8x32_epi32, _mm256_set1_ps,
    _mm256_setzero_ps, _mm256_store_ps, _mm256_storeu_si256, _mm256_sub_ps, _mm256_xor_ps,
};
use std::mem::MaybeUninit;

use crate::node::{Node8, PairLeaf, STACK_CAPACITY, Tree};
use crate::ray::{Hit, Ray};
use crate::traverse::keep::Keep;
use crate::traverse::kernel::{Candidates, Distances, Kernel, Lanes};
use crate::traverse::stack::{Entry, Links, Storage};
use crate::traverse::tree_ray::TreeRay;
use crate::traverse::two_level::{self, Scene};

/// Products of tiny triangles lose digits below this: nothing there is certain.
const UNDERFLOW: f32 = 1e-34;

/// Proof that the processor has AVX2, FMA, BMI and POPCNT: only [`Avx2::detect`] makes one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

impl Avx2 {
    pub(crate) fn detect() -> Option<Self> {
        let has_all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt");
        has_all.then_some(Self(()))
    }

    #[inline(always)]
    pub(crate) fn closest(self, scene: Scene<'_>, ray: &Ray, keep: impl Keep) -> Option<Hit> {
        // SAFETY: `self` proves the features.
        unsafe {
            match scene {
                Scene::Single(tree) => closest_in_tree(self, tree, ray, keep),
                _ => closest(self, scene, ray, keep),
            }
        }
    }

    #[inline(always)]
    pub(crate) fn occluded(self, scene: Scene<'_>, ray: &Ray, keep: impl Keep) -> bool {
        // SAFETY: `self` proves the features.
        unsafe {
            match scene {
                Scene::Single(tree) => occluded_in_tree(self, tree, ray, keep),
                _ => occluded(self, scene, ray, keep),
            }
        }
    }
}

// A single tree has functions of its own: registers and stack for instances would burden it.

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn closest_in_tree(avx2: Avx2, tree: &Tree, ray: &Ray, keep: impl Keep) -> Option<Hit> {
    two_level::closest(avx2, Scene::Single(tree), ray, keep)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn occluded_in_tree(avx2: Avx2, tree: &Tree, ray: &Ray, keep: impl Keep) -> bool {
    two_level::occluded(avx2, Scene::Single(tree), ray, keep)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn closest(avx2: Avx2, scene: Scene<'_>, ray: &Ray, keep: impl Keep) -> Option<Hit> {
    two_level::closest(avx2, scene, ray, keep)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn occluded(avx2: Avx2, scene: Scene<'_>, ray: &Ray, keep: impl Keep) -> bool {
    two_level::occluded(avx2, scene, ray, keep)
}

/// See [`Kernel::NodeRay`].
#[derive(Clone, Copy)]
pub(crate) struct NodeRay {
    near_rcp: [__m256; 3],
    far_rcp: [__m256; 3],
    /// Minus the origin times the reciprocal, a little less than that for near planes ...
    near_offset: [__m256; 3],
    /// ... and a little more for far ones.
    far_offset: [__m256; 3],
    t_min: __m256,
    /// Row of the near plane, by axis.
    near_plane: [usize; 3],
}

/// See [`Kernel::LeafRay`].
#[derive(Clone, Copy)]
pub(crate) struct LeafRay {
    /// By axis as sheared: the direction's own last.
    origin: [__m256; 3],
    shear: [__m256; 2],
    axes: [usize; 3],
    /// See [`TreeRay::dir_largest`].
    dir_largest: __m256,
    t_min: __m256,
    rounded_size: __m256,
}

impl Kernel for Avx2 {
    type NodeRay = NodeRay;
    type LeafRay = LeafRay;
    type Storage = Unchecked;
    type Links = UncheckedLinks;

    #[inline(always)]
    fn node_ray(self, ray: &TreeRay) -> NodeRay {
        let near_offset = offset(ray.origin, ray.near_rcp, -1.0);
        let far_offset = offset(ray.origin, ray.far_rcp, 1.0);
        // SAFETY: `self` proves the features.
        unsafe {
            NodeRay {
                near_rcp: splat8(ray.near_rcp),
                far_rcp: splat8(ray.far_rcp),
                near_offset: splat8(near_offset),
                far_offset: splat8(far_offset),
                t_min: _mm256_set1_ps(ray.t_min),
                near_plane: ray.near_plane,
            }
        }
    }

    #[inline(always)]
    fn leaf_ray(self, ray: &TreeRay) -> LeafRay {
        let [kx, ky, kz] = ray.axes;
        // SAFETY: `self` proves the features.
        unsafe {
            LeafRay {
                origin: [
                    _mm256_set1_ps(ray.origin[kx]),
                    _mm256_set1_ps(ray.origin[ky]),
                    _mm256_set1_ps(ray.origin[kz]),
                ],
                shear: [_mm256_set1_ps(ray.shear[0]), _mm256_set1_ps(ray.shear[1])],
                axes: ray.axes,
                dir_largest: _mm256_set1_ps(ray.dir_largest()),
                t_min: _mm256_set1_ps(ray.t_min),
                rounded_size: _mm256_set1_ps(ray.rounded_size),
            }
        }
    }

    #[inline(always)]
    fn slabs(self, ray: &NodeRay, limit: f32, node: &Node8) -> (u32, Lanes) {
        let mut entries = Lanes([0.0; 8]);
        // SAFETY: `self` proves the features; `near_plane` is below 6, and flipping bit 0 keeps it
        // so; a row of planes is 32 bytes in a node aligned to 64, and `Lanes` is aligned to 32.
        unsafe {
            let near = |axis: usize| {
                let planes = plane_row(node, ray.near_plane[axis]);
                _mm256_fmadd_ps(planes, ray.near_rcp[axis], ray.near_offset[axis])
            };
            let far = |axis: usize| {
                let planes = plane_row(node, ray.near_plane[axis] ^ 1);
                _mm256_fmadd_ps(planes, ray.far_rcp[axis], ray.far_offset[axis])
            };
            let near = _mm256_max_ps(
                _mm256_max_ps(near(0), near(1)),
                _mm256_max_ps(near(2), ray.t_min),
            );
            let far = _mm256_min_ps(
                _mm256_min_ps(far(0), far(1)),
                _mm256_min_ps(far(2), _mm256_set1_ps(limit)),
            );
            _mm256_store_ps(entries.0.as_mut_ptr(), near);
            let hit = _mm256_cmp_ps::<_CMP_LE_OQ>(near, far);
            (_mm256_movemask_ps(hit) as u32, entries)
        }
    }

    #[inline(always)]
    fn candidates(
        self,
        ray: &LeafRay,
        limit: f32,
        leaf: &PairLeaf,
        distances: &mut Distances,
    ) -> Candidates {
        // SAFETY: `self` proves the features; rows of corners are aligned to 16 bytes, each but
        // the last of an axis is followed by the next, and `Lanes` is aligned to 32.
        unsafe {
            let rows = leaf.corners.as_ptr().cast::<f32>();
            let row = |axis: usize, corner: usize| rows.add(axis * 16 + corner * 4);
            let twice = |axis| _mm256_broadcast_ps(&_mm_load_ps(row(axis, 0)));
            let two = |corner| move |axis| _mm256_loadu_ps(row(axis, corner));
            let (ax, ay, az) = shear(ray, twice);
            let (bx, by, bz) = shear(ray, two(1));
            let (cx, cy, cz) = shear(ray, two(2));
            let u = cross(cx, cy, bx, by);
            let v = cross(ax, ay, cx, cy);
            let w = cross(bx, by, ax, ay);
            let zero = _mm256_setzero_ps();
            let low = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let high = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let inside = _mm256_or_ps(
                _mm256_cmp_ps::<_CMP_GE_OQ>(low, zero),
                _mm256_cmp_ps::<_CMP_LE_OQ>(high, zero),
            );
            if _mm256_movemask_ps(inside) == 0 {
                return Candidates {
                    possible: 0,
                    certain: 0,
                };
            }

            // Distance times `scale`, and how far off it and the edge functions may be.
            let minus_zero = _mm256_set1_ps(-0.0);
            let scale = _mm256_mul_ps(_mm256_add_ps(_mm256_add_ps(u, v), w), ray.dir_largest);
            let along = _mm256_fmadd_ps(u, az, _mm256_fmadd_ps(v, bz, _mm256_mul_ps(w, cz)));
            let distance = _mm256_xor_ps(along, _mm256_and_ps(scale, minus_zero));
            let scale = _mm256_andnot_ps(minus_zero, scale);
            let [edge_error, longest] = leaf.error;
            let reach = _mm256_add_ps(
                _mm256_andnot_ps(minus_zero, az),
                _mm256_add_ps(ray.rounded_size, _mm256_set1_ps(3.0 * longest)),
            );
            let underflow = _mm256_set1_ps(UNDERFLOW);
            let edge_error = _mm256_fmadd_ps(_mm256_set1_ps(edge_error), reach, underflow);
            let error = _mm256_fmadd_ps(_mm256_set1_ps(6.0 * longest), edge_error, underflow);

            // What is not certainly out of the range is possible; a NaN excludes nothing.
            let nearest = _mm256_sub_ps(distance, error);
            let furthest = _mm256_add_ps(distance, error);
            let begin = _mm256_mul_ps(scale, ray.t_min);
            let end = _mm256_mul_ps(scale, _mm256_set1_ps(limit));
            let outside = _mm256_or_ps(
                _mm256_cmp_ps::<_CMP_LT_OQ>(furthest, begin),
                _mm256_cmp_ps::<_CMP_GT_OQ>(nearest, end),
            );
            let clear_of_edges = _mm256_or_ps(
                _mm256_cmp_ps::<_CMP_GT_OQ>(low, edge_error),
                _mm256_cmp_ps::<_CMP_GT_OQ>(_mm256_xor_ps(high, minus_zero), edge_error),
            );
            let in_range = _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_GT_OQ>(nearest, begin),
                _mm256_cmp_ps::<_CMP_LT_OQ>(furthest, end),
            );
            let certain = _mm256_and_ps(clear_of_edges, in_range);

            let candidates = Candidates {
                possible: _mm256_movemask_ps(_mm256_andnot_ps(outside, inside)) as u32,
                certain: _mm256_movemask_ps(certain) as u32,
            };
            if candidates.certain != 0 {
                let rcp_scale = _mm256_div_ps(_mm256_set1_ps(1.0), scale);
                let below = _mm256_set1_ps(1.0 - 4.0 * f32::EPSILON);
                let above = _mm256_set1_ps(1.0 + 4.0 * f32::EPSILON);
                _mm256_store_ps(
                    distances.nearest.0.as_mut_ptr(),
                    _mm256_mul_ps(_mm256_mul_ps(nearest, rcp_scale), below),
                );
                _mm256_store_ps(
                    distances.furthest.0.as_mut_ptr(),
                    _mm256_mul_ps(_mm256_mul_ps(furthest, rcp_scale), above),
                );
            }
            candidates
        }
    }

    #[inline(always)]
    fn item<T>(self, items: &[T], link: u32) -> &T {
        debug_assert!((link as usize) < items.len());
        // SAFETY: links come from nodes of the same tree, built only by this crate, and every
        // link that a walk can reach names an item (`validate` checks it in tests).
        unsafe { items.get_unchecked(link as usize) }
    }

    #[inline(always)]
    fn prefetch(self, address: *const u8) {
        let line = address.cast::<i8>();
        // SAFETY: prefetching has no effect on memory and any address is allowed.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(line);
            _mm_prefetch::<_MM_HINT_T0>(line.wrapping_add(64));
            _mm_prefetch::<_MM_HINT_T0>(line.wrapping_add(128));
            _mm_prefetch::<_MM_HINT_T0>(line.wrapping_add(192));
        }
    }
}

/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn splat8(x: [f32; 3]) -> [__m256; 3] {
    // SAFETY: as the caller promises.
    unsafe {
        [
            _mm256_set1_ps(x[0]),
            _mm256_set1_ps(x[1]),
            _mm256_set1_ps(x[2]),
        ]
    }
}

/// What is to be added to planes times reciprocals: minus the origin times them, moved by more than
/// rounding that product can lose, in the direction of `sign`. The product of the plane is not
/// rounded, and all else is relative to the distance, as the reciprocals allow for.
#[inline(always)]
fn offset(origin: [f32; 3], rcp: [f32; 3], sign: f32) -> [f32; 3] {
    let along = |axis: usize| {
        // Finite, or else the infinite boxes of unused lanes would make it a NaN.
        let product = (origin[axis] * rcp[axis]).clamp(-1e38, 1e38);
        sign * product.abs() * (2.0 * f32::EPSILON) - product
    };
    [along(0), along(1), along(2)]
}

/// A row of planes.
///
/// # Safety
/// Needs AVX2 and `plane < 6`.
#[inline(always)]
unsafe fn plane_row(node: &Node8, plane: usize) -> __m256 {
    // SAFETY: the row is inside `planes` and aligned to 32 bytes.
    unsafe { _mm256_load_ps(node.planes.as_ptr().cast::<f32>().add(plane * 8)) }
}

/// A corner of each triangle, sheared into the plane across the ray, and how far along;
/// `coordinates` loads those of an axis.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn shear(ray: &LeafRay, coordinates: impl Fn(usize) -> __m256) -> (__m256, __m256, __m256) {
    let [kx, ky, kz] = ray.axes;
    // SAFETY: as the caller promises.
    unsafe {
        let x = _mm256_sub_ps(coordinates(kx), ray.origin[0]);
        let y = _mm256_sub_ps(coordinates(ky), ray.origin[1]);
        let along = _mm256_sub_ps(coordinates(kz), ray.origin[2]);
        (
            _mm256_sub_ps(x, _mm256_mul_ps(ray.shear[0], along)),
            _mm256_sub_ps(y, _mm256_mul_ps(ray.shear[1], along)),
            along,
        )
    }
}

/// `ax by - ay bx` without FMA: both products round alike from either side of an edge.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn cross(ax: __m256, ay: __m256, bx: __m256, by: __m256) -> __m256 {
    // SAFETY: as the caller promises.
    unsafe { _mm256_sub_ps(_mm256_mul_ps(ax, by), _mm256_mul_ps(ay, bx)) }
}

/// Storage that is neither cleared nor checked.
pub(crate) struct Unchecked([MaybeUninit<Entry>; STACK_CAPACITY]);

impl Storage for Unchecked {
    #[inline(always)]
    fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; STACK_CAPACITY])
    }

    #[inline(always)]
    fn write(&mut self, index: usize, entry: Entry) {
        debug_assert!(index < STACK_CAPACITY);
        // SAFETY: builds bound the entries of every walk by the capacity.
        unsafe { self.0.get_unchecked_mut(index) }.write(entry);
    }

    #[inline(always)]
    fn read(&self, index: usize) -> Entry {
        debug_assert!(index < STACK_CAPACITY);
        // SAFETY: `Stack` reads below its length alone, where it has written before.
        unsafe { self.0.get_unchecked(index).assume_init() }
    }
}

/// Links that are neither cleared nor checked. Lanes are written eight at a time.
pub(crate) struct UncheckedLinks([MaybeUninit<u32>; STACK_CAPACITY + 8]);

impl Links for UncheckedLinks {
    #[inline(always)]
    fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; STACK_CAPACITY + 8])
    }

    #[inline(always)]
    fn push_lanes(&mut self, len: usize, links: &[u32; 8], mask: u32) -> usize {
        debug_assert!(len <= STACK_CAPACITY);
        // SAFETY: the processor has AVX2, since only its kernel makes such a stack; builds bound
        // the entries of every walk by the capacity, and there is room for eight more.
        unsafe {
            let order = &raw const FIRST_LANES[(mask & 255) as usize];
            let order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(order.cast()));
            let lanes = _mm256_loadu_si256(links.as_ptr().cast());
            let packed = _mm256_permutevar8x32_epi32(lanes, order);
            _mm256_storeu_si256(self.0.as_mut_ptr().add(len).cast(), packed);
        }
        len + mask.count_ones() as usize
    }

    #[inline(always)]
    fn read(&self, index: usize) -> u32 {
        debug_assert!(index < STACK_CAPACITY);
        // SAFETY: walks read below their length alone, where they have written before.
        unsafe { self.0.get_unchecked(index).assume_init() }
    }
}

/// By mask: the lanes in it, in order.
static FIRST_LANES: [[u8; 8]; 256] = {
    let mut lanes = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut n) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                lanes[mask][n] = lane as u8;
                n += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    lanes
};
