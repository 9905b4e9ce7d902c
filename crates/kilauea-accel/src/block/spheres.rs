use super::{Block, BlockRay, Limit};
use crate::motion::{MotionNode8, lerp};
use crate::node::Node8;
use crate::primitive::{RayFrame, Sphere};
use crate::traverse::Kernel;
use kilauea_math::{Bounds3, DVec3};

/// Four spheres, one lane each.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct SphereBlock {
    /// By axis and lane.
    pub(crate) center: [[f32; 4]; 3],
    /// NaN in unused lanes, which no test accepts.
    pub(crate) radius: [f32; 4],
    /// Sphere within its geometry, `u32::MAX` in unused lanes.
    pub(crate) primitive: [u32; 4],
}

impl SphereBlock {
    /// At most four spheres with their ids.
    pub(crate) fn new(spheres: impl IntoIterator<Item = (Sphere, u32)>) -> Self {
        let mut block = Self {
            center: [[0.0; 4]; 3],
            radius: [f32::NAN; 4],
            primitive: [u32::MAX; 4],
        };
        for (lane, (sphere, primitive)) in spheres.into_iter().enumerate() {
            for axis in 0..3 {
                block.center[axis][lane] = sphere.center[axis];
            }
            block.radius[lane] = sphere.radius;
            block.primitive[lane] = primitive;
        }
        block
    }

    fn sphere(&self, lane: usize) -> Sphere {
        Sphere {
            center: self.center.map(|axis| axis[lane]),
            radius: self.radius[lane],
        }
    }

    /// The lanes whose spheres the line meets.
    #[inline(always)]
    fn met(&self, ray: &RayFrame) -> u32 {
        let [x, y, _] = ray.axes();
        let origin = ray.origin();
        // Lane by lane alike, so that compilers turn it into vectors.
        let met: [bool; 4] = std::array::from_fn(|lane| {
            let from_origin = |axis: usize| f64::from(self.center[axis][lane]) - origin[axis];
            let center = [from_origin(0), from_origin(1), from_origin(2)];
            let along = |a: DVec3| center[0] * a.x + center[1] * a.y + center[2] * a.z;
            let (x, y) = (along(x), along(y));
            let radius = f64::from(self.radius[lane]);
            x * x + y * y <= radius * radius
        });
        (0..4).fold(0, |mask, lane| mask | u32::from(met[lane]) << lane)
    }

    #[inline(always)]
    fn offer_hits(&self, ray: &RayFrame, mut offer: impl FnMut(u32, [f32; 3]) -> bool) {
        let mut met = self.met(ray);
        while met != 0 {
            let lane = (met.trailing_zeros() & 3) as usize;
            met &= met - 1;
            if let Some(place) = self.sphere(lane).intersect(ray)
                && offer(self.primitive[lane], place.rounded())
            {
                return;
            }
        }
    }

    fn primitives(&self) -> impl Iterator<Item = (u32, Bounds3)> {
        (0..4)
            .filter(|&lane| self.primitive[lane] != u32::MAX)
            .map(|lane| (self.primitive[lane], self.sphere(lane).bounds()))
    }
}

impl Block for SphereBlock {
    type Node = Node8;
    type Store = ();
    type Ray<K: Kernel> = RayFrame;

    #[inline(always)]
    fn ray<K: Kernel>(_: K, ray: &BlockRay<'_>) -> RayFrame {
        ray.frame()
    }

    #[inline(always)]
    fn intersect<K: Kernel>(
        &self,
        (): &(),
        _: K,
        ray: &RayFrame,
        _: Limit,
        offer: impl FnMut(u32, [f32; 3]) -> bool,
    ) {
        self.offer_hits(ray, offer);
    }

    fn primitives(&self, (): &()) -> Vec<(u32, [Bounds3; 2])> {
        self.primitives().map(|(id, b)| (id, [b, b])).collect()
    }
}

/// Four spheres whose centers move.
#[derive(Clone, Debug)]
pub(crate) struct MovingSphereBlock {
    /// The same spheres as an interval begins and ends.
    pub(crate) ends: [SphereBlock; 2],
}

impl Block for MovingSphereBlock {
    type Node = MotionNode8;
    type Store = ();
    type Ray<K: Kernel> = (RayFrame, f32);

    #[inline(always)]
    fn ray<K: Kernel>(_: K, ray: &BlockRay<'_>) -> (RayFrame, f32) {
        (ray.frame(), ray.fraction)
    }

    #[inline(always)]
    fn intersect<K: Kernel>(
        &self,
        (): &(),
        _: K,
        (ray, fraction): &(RayFrame, f32),
        _: Limit,
        offer: impl FnMut(u32, [f32; 3]) -> bool,
    ) {
        let mut block = self.ends[0];
        for axis in 0..3 {
            for lane in 0..4 {
                let [first, last] = [0, 1].map(|end| self.ends[end].center[axis][lane]);
                block.center[axis][lane] = lerp(first, last, *fraction);
            }
        }
        block.offer_hits(ray, offer);
    }

    fn primitives(&self, (): &()) -> Vec<(u32, [Bounds3; 2])> {
        let [first, last] = &self.ends;
        let pairs = first.primitives().zip(last.primitives());
        pairs.map(|((id, a), (_, b))| (id, [a, b])).collect()
    }
}
