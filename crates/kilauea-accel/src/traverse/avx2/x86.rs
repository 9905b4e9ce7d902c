use std::arch::is_x86_feature_detected;
use std::arch::x86_64::{
    __m128, __m256, _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _MM_HINT_T0, _mm_add_ps,
    _mm_and_ps, _mm_andnot_ps, _mm_cmp_ps, _mm_fmadd_ps, _mm_load_ps, _mm_max_ps, _mm_min_ps,
    _mm_movemask_ps, _mm_mul_ps, _mm_or_ps, _mm_prefetch, _mm_set1_ps, _mm_setzero_ps, _mm_sub_ps,
    _mm_xor_ps, _mm256_cmp_ps, _mm256_load_ps, _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps,
    _mm256_mul_ps, _mm256_set1_ps, _mm256_store_ps, _mm256_sub_ps,
};
use std::mem::MaybeUninit;

use crate::node::{Leaf4, Node8, STACK_CAPACITY};
use crate::ray::{Hit, Ray};
use crate::traverse::kernel::{Entries, Kernel};
use crate::traverse::stack::{Entry, Storage};
use crate::traverse::tree_ray::TreeRay;
use crate::traverse::two_level::{self, Scene};

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
    pub(crate) fn closest(
        self,
        scene: Scene<'_>,
        ray: &Ray,
        keep: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        // SAFETY: `self` proves the features.
        unsafe { closest(self, scene, ray, keep) }
    }

    #[inline(always)]
    pub(crate) fn occluded(
        self,
        scene: Scene<'_>,
        ray: &Ray,
        keep: impl FnMut(&Hit) -> bool,
    ) -> bool {
        // SAFETY: `self` proves the features.
        unsafe { occluded(self, scene, ray, keep) }
    }
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn closest(avx2: Avx2, scene: Scene<'_>, ray: &Ray, keep: impl FnMut(&Hit) -> bool) -> Option<Hit> {
    two_level::closest(avx2, scene, ray, keep)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn occluded(avx2: Avx2, scene: Scene<'_>, ray: &Ray, keep: impl FnMut(&Hit) -> bool) -> bool {
    two_level::occluded(avx2, scene, ray, keep)
}

/// See [`Kernel::NodeRay`].
#[derive(Clone, Copy)]
pub(crate) struct NodeRay {
    origin: [__m256; 3],
    near_rcp: [__m256; 3],
    far_rcp: [__m256; 3],
    t_min: __m256,
    /// Row of the near plane, by axis.
    near_plane: [usize; 3],
}

/// See [`Kernel::LeafRay`].
#[derive(Clone, Copy)]
pub(crate) struct LeafRay {
    /// By axis as sheared: the direction's own last.
    origin: [__m128; 3],
    shear: [__m128; 2],
    axes: [usize; 3],
    /// Largest component of the direction, by which distances in the tree count.
    dir_largest: __m128,
    t_min: __m128,
    rounded_size: __m128,
}

impl Kernel for Avx2 {
    type NodeRay = NodeRay;
    type LeafRay = LeafRay;
    type Storage = Unchecked;

    #[inline(always)]
    fn node_ray(self, ray: &TreeRay) -> NodeRay {
        // SAFETY: `self` proves the features.
        unsafe {
            NodeRay {
                origin: splat8(ray.origin),
                near_rcp: splat8(ray.near_rcp),
                far_rcp: splat8(ray.far_rcp),
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
                    _mm_set1_ps(ray.origin[kx]),
                    _mm_set1_ps(ray.origin[ky]),
                    _mm_set1_ps(ray.origin[kz]),
                ],
                shear: [_mm_set1_ps(ray.shear[0]), _mm_set1_ps(ray.shear[1])],
                axes: ray.axes,
                dir_largest: _mm_set1_ps((ray.dir_f64[kz] / ray.t_scale) as f32),
                t_min: _mm_set1_ps(ray.t_min),
                rounded_size: _mm_set1_ps(ray.rounded_size),
            }
        }
    }

    #[inline(always)]
    fn slabs(self, ray: &NodeRay, limit: f32, node: &Node8) -> (u32, Entries) {
        let mut entries = Entries([0.0; 8]);
        // SAFETY: `self` proves the features; `near_plane` is below 6, and flipping bit 0 keeps it
        // so; a row of planes is 32 bytes in a node aligned to 64, and `Entries` is aligned to 32.
        unsafe {
            let near_x = slab(node, ray.near_plane[0], ray.origin[0], ray.near_rcp[0]);
            let near_y = slab(node, ray.near_plane[1], ray.origin[1], ray.near_rcp[1]);
            let near_z = slab(node, ray.near_plane[2], ray.origin[2], ray.near_rcp[2]);
            let far_x = slab(node, ray.near_plane[0] ^ 1, ray.origin[0], ray.far_rcp[0]);
            let far_y = slab(node, ray.near_plane[1] ^ 1, ray.origin[1], ray.far_rcp[1]);
            let far_z = slab(node, ray.near_plane[2] ^ 1, ray.origin[2], ray.far_rcp[2]);
            let near = _mm256_max_ps(
                _mm256_max_ps(near_x, near_y),
                _mm256_max_ps(near_z, ray.t_min),
            );
            let far = _mm256_min_ps(
                _mm256_min_ps(far_x, far_y),
                _mm256_min_ps(far_z, _mm256_set1_ps(limit)),
            );
            _mm256_store_ps(entries.0.as_mut_ptr(), near);
            let hit = _mm256_cmp_ps::<_CMP_LE_OQ>(near, far);
            (_mm256_movemask_ps(hit) as u32, entries)
        }
    }

    #[inline(always)]
    fn candidates(self, ray: &LeafRay, limit: f32, leaf: &Leaf4) -> u32 {
        // SAFETY: `self` proves the features.
        unsafe {
            let (ax, ay, az) = shear(ray, leaf, 0);
            let (bx, by, bz) = shear(ray, leaf, 1);
            let (cx, cy, cz) = shear(ray, leaf, 2);
            let u = cross(cx, cy, bx, by);
            let v = cross(ax, ay, cx, cy);
            let w = cross(bx, by, ax, ay);
            let zero = _mm_setzero_ps();
            let low = _mm_min_ps(_mm_min_ps(u, v), w);
            let high = _mm_max_ps(_mm_max_ps(u, v), w);
            let inside = _mm_or_ps(
                _mm_cmp_ps::<_CMP_GE_OQ>(low, zero),
                _mm_cmp_ps::<_CMP_LE_OQ>(high, zero),
            );

            // Distance times `scale`, and how far off it may be. A NaN excludes nothing.
            let minus_zero = _mm_set1_ps(-0.0);
            let scale = _mm_mul_ps(_mm_add_ps(_mm_add_ps(u, v), w), ray.dir_largest);
            let along = _mm_fmadd_ps(u, az, _mm_fmadd_ps(v, bz, _mm_mul_ps(w, cz)));
            let distance = _mm_xor_ps(along, _mm_and_ps(scale, minus_zero));
            let scale = _mm_andnot_ps(minus_zero, scale);
            let error = _mm_fmadd_ps(
                _mm_set1_ps(leaf.error[0]),
                _mm_add_ps(_mm_andnot_ps(minus_zero, az), ray.rounded_size),
                _mm_set1_ps(leaf.error[1]),
            );
            let before =
                _mm_cmp_ps::<_CMP_LT_OQ>(_mm_add_ps(distance, error), _mm_mul_ps(scale, ray.t_min));
            let beyond = _mm_cmp_ps::<_CMP_GT_OQ>(
                _mm_sub_ps(distance, error),
                _mm_mul_ps(scale, _mm_set1_ps(limit)),
            );
            let outside = _mm_or_ps(before, beyond);
            _mm_movemask_ps(_mm_andnot_ps(outside, inside)) as u32
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

/// Distances to a row of planes: subtract, then multiply.
///
/// # Safety
/// Needs AVX2 and `plane < 6`.
#[inline(always)]
unsafe fn slab(node: &Node8, plane: usize, origin: __m256, rcp: __m256) -> __m256 {
    // SAFETY: the row is inside `planes` and aligned to 32 bytes.
    unsafe {
        let row = node.planes.as_ptr().cast::<f32>().add(plane * 8);
        _mm256_mul_ps(_mm256_sub_ps(_mm256_load_ps(row), origin), rcp)
    }
}

/// A corner of each triangle, sheared into the plane across the ray, and how far along.
///
/// # Safety
/// Needs AVX2 and `vertex < 3`.
#[inline(always)]
unsafe fn shear(ray: &LeafRay, leaf: &Leaf4, vertex: usize) -> (__m128, __m128, __m128) {
    let corner = leaf.v.as_ptr().cast::<f32>().wrapping_add(vertex * 12);
    let [kx, ky, kz] = ray.axes;
    // SAFETY: the axes are below 3, so each row is inside `v`; rows are aligned to 16 bytes.
    unsafe {
        let x = _mm_sub_ps(_mm_load_ps(corner.add(kx * 4)), ray.origin[0]);
        let y = _mm_sub_ps(_mm_load_ps(corner.add(ky * 4)), ray.origin[1]);
        let along = _mm_sub_ps(_mm_load_ps(corner.add(kz * 4)), ray.origin[2]);
        (
            _mm_sub_ps(x, _mm_mul_ps(ray.shear[0], along)),
            _mm_sub_ps(y, _mm_mul_ps(ray.shear[1], along)),
            along,
        )
    }
}

/// `ax by - ay bx` without FMA: both products round alike from either side of an edge.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn cross(ax: __m128, ay: __m128, bx: __m128, by: __m128) -> __m128 {
    // SAFETY: as the caller promises.
    unsafe { _mm_sub_ps(_mm_mul_ps(ax, by), _mm_mul_ps(ay, bx)) }
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
