use std::arch::is_x86_feature_detected;
use std::arch::x86_64::{
    __m128, __m256, _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _MM_HINT_T0, _mm_div_ps,
    _mm_fmsub_ps, _mm_fnmsub_ps, _mm_load_ps, _mm_load_si128, _mm_movemask_ps, _mm_mul_ps,
    _mm_permute_ps, _mm_permutevar_ps, _mm_prefetch, _mm_set1_ps, _mm_store_ps, _mm256_add_ps,
    _mm256_and_ps, _mm256_andnot_ps, _mm256_broadcast_ps, _mm256_broadcast_ss,
    _mm256_broadcastss_ps, _mm256_castps_si256, _mm256_castsi256_ps, _mm256_cmp_ps,
    _mm256_cmpgt_epi32, _mm256_div_ps, _mm256_fmadd_ps, _mm256_load_ps, _mm256_loadu_ps,
    _mm256_max_epi32, _mm256_max_ps, _mm256_min_epi32, _mm256_min_ps, _mm256_movemask_ps,
    _mm256_mul_ps, _mm256_or_ps, _mm256_set1_ps, _mm256_setzero_ps, _mm256_store_ps,
    _mm256_store_si256, _mm256_sub_ps, _mm256_xor_ps,
};

use super::position::position;
use super::storage::{Unchecked, UncheckedLinks};
use crate::node::{Node8, PairLeaf, Tree};
use crate::ray::{Hit, Ray};
use crate::traverse::keep::Keep;
use crate::traverse::kernel::{Candidates, Distances, Kernel, Lanes};
use crate::traverse::tree_ray::{Line, SLAB_SLACK, TreeRay};
use crate::traverse::two_level::{self, Scene};
use crate::traverse::walk::Visitor;

/// Products of tiny triangles lose digits below this: nothing there is certain.
const UNDERFLOW: f32 = 1e-34;

/// Proof that the processor has AVX2, FMA, BMI and POPCNT: only [`Avx2::detect`] makes one.
///
/// Where rays are `COHERENT`, each goes much like the one before, and the branch predictor can tell
/// which child of a node comes next before the boxes have been tested.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2<const COHERENT: bool = false>(());

impl Avx2 {
    pub(crate) fn detect() -> Option<Self> {
        let has_all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt");
        has_all.then_some(Self(()))
    }

    /// The same for coherent rays.
    #[inline(always)]
    pub(crate) fn coherent(self) -> Avx2<true> {
        let Self(proof) = self;
        Avx2(proof)
    }

    #[inline(always)]
    pub(crate) fn pierce<L: Line>(
        self,
        nodes: &[Node8],
        ray: &TreeRay<L>,
        visitor: &mut impl Visitor,
    ) {
        // SAFETY: `self` proves the features.
        unsafe { pierce(self, nodes, ray, visitor) }
    }
}

impl<const COHERENT: bool> Avx2<COHERENT> {
    #[inline(always)]
    pub(crate) fn closest<L: Line>(
        self,
        scene: Scene<'_>,
        rays: (&Ray, impl FnOnce() -> TreeRay<L>),
        keep: impl Keep,
    ) -> Option<Hit> {
        // SAFETY: `self` proves the features.
        unsafe {
            match scene {
                Scene::Single(tree) => closest_in_tree(self, tree, rays, keep),
                _ => closest(self, scene, rays, keep),
            }
        }
    }

    #[inline(always)]
    pub(crate) fn occluded<L: Line>(
        self,
        scene: Scene<'_>,
        rays: (&Ray, impl FnOnce() -> TreeRay<L>),
        keep: impl Keep,
    ) -> bool {
        // SAFETY: `self` proves the features.
        unsafe {
            match scene {
                Scene::Single(tree) => occluded_in_tree(self, tree, rays, keep),
                _ => occluded(self, scene, rays, keep),
            }
        }
    }
}

// A single tree has functions of its own: registers and stack for instances would burden it.

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn pierce<L: Line>(avx2: Avx2, nodes: &[Node8], ray: &TreeRay<L>, visitor: &mut impl Visitor) {
    two_level::pierce(avx2, nodes, ray, visitor);
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn closest_in_tree<const COHERENT: bool, L: Line>(
    avx2: Avx2<COHERENT>,
    tree: &Tree,
    rays: (&Ray, impl FnOnce() -> TreeRay<L>),
    keep: impl Keep,
) -> Option<Hit> {
    two_level::closest(avx2, Scene::Single(tree), rays, keep)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn occluded_in_tree<const COHERENT: bool, L: Line>(
    avx2: Avx2<COHERENT>,
    tree: &Tree,
    rays: (&Ray, impl FnOnce() -> TreeRay<L>),
    keep: impl Keep,
) -> bool {
    two_level::occluded(avx2, Scene::Single(tree), rays, keep)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn closest<const COHERENT: bool, L: Line>(
    avx2: Avx2<COHERENT>,
    scene: Scene<'_>,
    rays: (&Ray, impl FnOnce() -> TreeRay<L>),
    keep: impl Keep,
) -> Option<Hit> {
    two_level::closest(avx2, scene, rays, keep)
}

#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
fn occluded<const COHERENT: bool, L: Line>(
    avx2: Avx2<COHERENT>,
    scene: Scene<'_>,
    rays: (&Ray, impl FnOnce() -> TreeRay<L>),
    keep: impl Keep,
) -> bool {
    two_level::occluded(avx2, scene, rays, keep)
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
    rows: &'static Rows,
}

/// Where the rows of the near planes begin among the planes of a [`Node8`], by axis, and then those
/// of the far ones.
type Rows = [usize; 6];

/// By the signs of the direction: bit 0 is that of x.
static ROWS: [Rows; 8] = {
    const ROW: usize = 8;
    let mut rows = [[0; 6]; 8];
    let mut signs = 0;
    while signs < 8 {
        let mut axis = 0;
        while axis < 3 {
            let is_negative = signs >> axis & 1;
            rows[signs][axis] = (2 * axis + is_negative) * ROW;
            rows[signs][3 + axis] = (2 * axis + 1 - is_negative) * ROW;
            axis += 1;
        }
        signs += 1;
    }
    rows
};

/// See [`Kernel::LeafRay`]. What all lanes share is spread as it is loaded.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub(crate) struct LeafRay {
    /// By axis as sheared: that of the direction's largest component last.
    pub(super) origin: [f32; 4],
    /// Likewise.
    pub(super) dir: [f32; 4],
    /// The direction over its largest component.
    shear: [f32; 4],
    t_min: f32,
    rounded_size: f32,
    /// Where those of an axis begin among the coordinates of a leaf, in the order of `origin`.
    pub(super) axis_offset: &'static [usize; 3],
}

/// By the last axis; padded so that no index needs a check.
static AXIS_OFFSETS: [[usize; 3]; 4] = {
    /// Coordinates of an axis in [`PairLeaf`].
    const AXIS: usize = 16;
    let offset = [0, AXIS, 2 * AXIS];
    let last_z = [offset[0], offset[1], offset[2]];
    [
        [offset[1], offset[2], offset[0]],
        [offset[2], offset[0], offset[1]],
        last_z,
        last_z,
    ]
};

impl<const COHERENT: bool> Kernel for Avx2<COHERENT> {
    const COHERENT: bool = COHERENT;
    type NodeRay = NodeRay;
    type LeafRay = LeafRay;
    type Storage = Unchecked;
    type Links = UncheckedLinks;

    #[inline(always)]
    fn node_ray(self, ray: &TreeRay<impl Line>) -> NodeRay {
        /// More than what is rounded until the product of origin and reciprocal direction is
        /// subtracted from that of planes, which FMA does not round. All other roundings are
        /// relative to the distance, as [`SLAB_SLACK`] allows for.
        const PAD: f32 = 3.0 * f32::EPSILON;
        let rcp = ray.rcp();
        let origin = ray.origin * rcp;
        // SAFETY: `self` proves the features.
        unsafe {
            let signs = _mm_movemask_ps(ray.dir.into()) as usize;
            let (size, pad) = (origin.abs().into(), _mm_set1_ps(PAD));
            let near_origin = (origin * (1.0 - SLAB_SLACK)).into();
            let far_origin = (origin * (1.0 + SLAB_SLACK)).into();
            NodeRay {
                near_rcp: splat8((rcp * (1.0 - SLAB_SLACK)).into()),
                far_rcp: splat8((rcp * (1.0 + SLAB_SLACK)).into()),
                near_offset: splat8(_mm_fnmsub_ps(size, pad, near_origin)),
                far_offset: splat8(_mm_fmsub_ps(size, pad, far_origin)),
                t_min: _mm256_set1_ps(ray.t_min),
                rows: &ROWS[signs & 7],
            }
        }
    }

    #[inline(always)]
    fn leaf_ray(self, ray: &TreeRay<impl Line>) -> LeafRay {
        let mut leaf_ray = LeafRay {
            origin: [0.0; 4],
            dir: [0.0; 4],
            shear: [0.0; 4],
            t_min: ray.t_min,
            rounded_size: ray.rounded_size,
            axis_offset: &AXIS_OFFSETS[ray.largest_axis & 3],
        };
        // SAFETY: `self` proves the features; a row of the table has 16 bytes, and `LeafRay` and
        // its arrays of four are aligned to as many.
        unsafe {
            let turn = &raw const TURNS.0[ray.largest_axis & 3];
            let turn = _mm_load_si128(turn.cast());
            let origin = _mm_permutevar_ps(ray.origin.into(), turn);
            let dir = _mm_permutevar_ps(ray.dir.into(), turn);
            let largest = _mm_permute_ps::<0b10_10_10_10>(dir);
            let rcp_largest = _mm_div_ps(_mm_set1_ps(1.0), largest);
            let shear = _mm_mul_ps(dir, rcp_largest);
            _mm_store_ps(leaf_ray.origin.as_mut_ptr(), origin);
            _mm_store_ps(leaf_ray.dir.as_mut_ptr(), dir);
            _mm_store_ps(leaf_ray.shear.as_mut_ptr(), shear);
        }
        leaf_ray
    }

    #[inline(always)]
    fn slabs(self, ray: &NodeRay, limit: f32, node: &Node8) -> (u32, Lanes) {
        let mut entries = Lanes([0.0; 8]);
        // SAFETY: `self` proves the features; `ROWS` has the offsets of the six rows; rows and
        // `Lanes` are aligned to 32 bytes.
        unsafe {
            let rows = read_here(ray.rows);
            let near = |axis: usize| {
                let planes = plane_row(node, rows[axis]);
                let t = _mm256_fmadd_ps(planes, ray.near_rcp[axis], ray.near_offset[axis]);
                _mm256_castps_si256(t)
            };
            let far = |axis: usize| {
                let planes = plane_row(node, rows[3 + axis]);
                let t = _mm256_fmadd_ps(planes, ray.far_rcp[axis], ray.far_offset[axis]);
                _mm256_castps_si256(t)
            };
            // Bits of floats compare as integers where they are positive, and faster. Any negative
            // distance to a far plane is below all to near planes, of which `t_min` is one.
            let near = _mm256_max_epi32(
                _mm256_max_epi32(near(0), near(1)),
                _mm256_max_epi32(near(2), _mm256_castps_si256(ray.t_min)),
            );
            let far = _mm256_min_epi32(
                _mm256_min_epi32(far(0), far(1)),
                _mm256_min_epi32(far(2), _mm256_castps_si256(_mm256_set1_ps(limit))),
            );
            _mm256_store_si256(entries.0.as_mut_ptr().cast(), near);
            let passed = _mm256_castsi256_ps(_mm256_cmpgt_epi32(near, far));
            (!_mm256_movemask_ps(passed) as u32 & 255, entries)
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
            let ray = read_here(ray);
            let rows = leaf.corners.as_ptr().cast::<f32>();
            let row = |axis: usize, corner: usize| rows.add(ray.axis_offset[axis] + corner * 4);
            let twice = |axis| _mm256_broadcast_ps(&_mm_load_ps(row(axis, 0)));
            let two = |corner| move |axis| _mm256_loadu_ps(row(axis, corner));
            let (ax, ay, az) = shear(ray, twice);
            let (bx, by, bz) = shear(ray, two(1));
            let (cx, cy, cz) = shear(ray, two(2));
            let u = cross(cx, cy, bx, by);
            let v = cross(ax, ay, cx, cy);
            let w = cross(bx, by, ax, ay);
            // Where a lane has no triangle, u and v are NaN. Of a NaN and another, these give the
            // second, so both are NaN too.
            let low = _mm256_min_ps(_mm256_min_ps(w, v), u);
            let high = _mm256_max_ps(_mm256_max_ps(w, v), u);
            let zero = _mm256_setzero_ps();
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
            let scale = _mm256_mul_ps(_mm256_add_ps(_mm256_add_ps(u, v), w), spread(&ray.dir[2]));
            let along = _mm256_fmadd_ps(u, az, _mm256_fmadd_ps(v, bz, _mm256_mul_ps(w, cz)));
            let distance = _mm256_xor_ps(along, _mm256_and_ps(scale, minus_zero));
            let scale = _mm256_andnot_ps(minus_zero, scale);
            let [edge_error, longest] = leaf.error;
            let reach = _mm256_add_ps(
                _mm256_andnot_ps(minus_zero, az),
                _mm256_set1_ps(ray.rounded_size + 3.0 * longest),
            );
            let underflow = _mm256_set1_ps(UNDERFLOW);
            let edge_error = _mm256_fmadd_ps(_mm256_set1_ps(edge_error), reach, underflow);
            let error = _mm256_fmadd_ps(_mm256_set1_ps(6.0 * longest), edge_error, underflow);

            // What is not certainly out of the range is possible; a NaN excludes nothing.
            let nearest = _mm256_sub_ps(distance, error);
            let furthest = _mm256_add_ps(distance, error);
            let begin = _mm256_mul_ps(scale, spread(&ray.t_min));
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
    fn position(
        self,
        (ray, leaf_ray): (&TreeRay<impl Line>, &LeafRay),
        leaf: &PairLeaf,
        lane: usize,
    ) -> Option<[f32; 3]> {
        // SAFETY: `self` proves the features.
        unsafe { position(ray, leaf_ray, leaf, lane) }
    }

    #[inline(always)]
    fn position_apart(
        self,
        (ray, leaf_ray): (&TreeRay<impl Line>, &LeafRay),
        leaf: &PairLeaf,
        lane: usize,
    ) -> Option<[f32; 3]> {
        // SAFETY: `self` proves the features.
        unsafe { position_apart(*ray, leaf_ray, leaf, lane) }
    }

    #[inline(always)]
    fn first_lane<const PREDICTED: bool>(self, mask: u32) -> usize {
        let lane = (mask.trailing_zeros() & 7) as usize;
        if PREDICTED { predicted(lane) } else { lane }
    }

    #[inline(always)]
    fn last_lane(self, mask: u32) -> usize {
        predicted((mask.ilog2() & 7) as usize)
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
unsafe fn splat8(v: __m128) -> [__m256; 3] {
    // SAFETY: as the caller promises.
    unsafe {
        [
            _mm256_broadcastss_ps(v),
            _mm256_broadcastss_ps(_mm_permute_ps::<0b01_01_01_01>(v)),
            _mm256_broadcastss_ps(_mm_permute_ps::<0b10_10_10_10>(v)),
        ]
    }
}

/// All lanes alike.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn spread(x: &f32) -> __m256 {
    // SAFETY: as the caller promises.
    unsafe { _mm256_broadcast_ss(x) }
}

/// [`position`] by a call. The ray goes by value, so that it need not lie in memory before.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
#[inline(never)]
fn position_apart<L: Line>(
    ray: TreeRay<L>,
    leaf_ray: &LeafRay,
    leaf: &PairLeaf,
    lane: usize,
) -> Option<[f32; 3]> {
    // SAFETY: the function has the features.
    unsafe { position(&ray, leaf_ray, leaf, lane) }
}

/// The same, as something that the compiler does not know. It would read all of it before a loop, to
/// write most of that back into memory for want of registers.
#[inline(always)]
#[allow(
    clippy::pointers_in_nomem_asm_block,
    reason = "nothing is read there: the address only passes through"
)]
fn read_here<T>(x: &T) -> &T {
    let mut address: *const T = x;
    // SAFETY: no instruction is executed, and the address stays that of `x`.
    unsafe {
        std::arch::asm!("/* {0} */", inout(reg) address, options(nomem, nostack, preserves_flags));
        &*address
    }
}

/// A row of planes.
///
/// # Safety
/// Needs AVX2 and the offset of one of the six rows.
#[inline(always)]
unsafe fn plane_row(node: &Node8, row: usize) -> __m256 {
    // SAFETY: the row is inside `planes` and aligned to 32 bytes.
    unsafe { _mm256_load_ps(node.planes.as_ptr().cast::<f32>().add(row)) }
}

/// A corner of each triangle, sheared into the plane across the ray, and how far along;
/// `coordinates` loads those of an axis as sheared.
///
/// # Safety
/// Needs AVX2.
#[inline(always)]
unsafe fn shear(ray: &LeafRay, coordinates: impl Fn(usize) -> __m256) -> (__m256, __m256, __m256) {
    // SAFETY: as the caller promises.
    unsafe {
        let x = _mm256_sub_ps(coordinates(0), spread(&ray.origin[0]));
        let y = _mm256_sub_ps(coordinates(1), spread(&ray.origin[1]));
        let along = _mm256_sub_ps(coordinates(2), spread(&ray.origin[2]));
        (
            _mm256_sub_ps(x, _mm256_mul_ps(spread(&ray.shear[0]), along)),
            _mm256_sub_ps(y, _mm256_mul_ps(spread(&ray.shear[1]), along)),
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

/// The same lane, by a jump instead of a value: the processor goes on with the one that it predicts,
/// and what is loaded by its number need not wait.
#[inline(always)]
fn predicted(lane: usize) -> usize {
    match lane {
        0 => opaque(0),
        1 => opaque(1),
        2 => opaque(2),
        3 => opaque(3),
        4 => opaque(4),
        5 => opaque(5),
        6 => opaque(6),
        _ => opaque(7),
    }
}

/// A number that the compiler does not know, so that it keeps the jump that led to it.
#[inline(always)]
fn opaque(mut lane: usize) -> usize {
    // SAFETY: no instruction is executed.
    unsafe {
        std::arch::asm!("/* {0} */", inout(reg) lane, options(pure, nomem, nostack, preserves_flags));
    }
    lane & 7
}

/// By axis: what takes vectors to where it is last, as `_mm_permutevar_ps` reads it. Padded so that no
/// index needs a check.
static TURNS: Turns = Turns([[1, 2, 0, 3], [2, 0, 1, 3], [0, 1, 2, 3], [0, 1, 2, 3]]);

#[repr(align(16))]
struct Turns([[i32; 4]; 4]);
