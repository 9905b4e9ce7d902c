//! Choosing one of many lights by what each may contribute at a point.
//!
//! A binary tree over the lights holds, for each node, a box, a cone of emitting directions and
//! the total power; a descent picks children in proportion to a bound on their irradiance
//! (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting"; notation of PBR 4ed., 12.6.3).

use kilauea_math::{Bounds3, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

use super::walk::{LightWalk, takes_second};

/// What the tree knows of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightBounds {
    /// Box around the emitting surface.
    pub bounds: Bounds3,
    /// Power per steradian at the brightest, summed over colors in some fixed way.
    pub power: f32,
    /// Axis of the cone of normals.
    pub axis: Vec3,
    /// Cosine of the half angle of the cone of normals.
    pub cos_normals: f32,
    /// Cosine of the largest angle between a normal and an emitted direction.
    pub cos_emission: f32,
    /// Whether the back emits as well.
    pub is_two_sided: bool,
}

/// A light's number with what the tree knows of it.
type Entry = (u32, LightBounds);

/// The tree.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTree {
    /// Their powers are in units of `power_unit`.
    nodes: Vec<Node>,
    /// A power of two near the greatest power, so that sums of any powers are numbers.
    power_unit: f32,
    /// Turns from the root to each light, first turn in bit 0.
    trails: Vec<u64>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vec3,
    radius_sq: f32,
    axis: Vec3,
    power: f32,
    cos_normals: f32,
    sin_normals: f32,
    cos_emission: f32,
    is_two_sided: bool,
    is_leaf: bool,
    /// The light of a leaf; the second child of an inner node, whose first child comes next.
    link: u32,
}

/// What is at a node.
pub(super) enum TreeStep {
    Light(u32),
    Fork {
        /// Probability of the first child.
        first: f32,
        children: [usize; 2],
    },
}

/// Beyond it, light is as bright as can be: sums of importances must be numbers.
pub(super) const MAX_IMPORTANCE: f32 = 1e30;

/// Trails are 64 bits long: below this depth nodes are halved, so that they suffice.
const MAX_UNBALANCED_DEPTH: u32 = 30;

impl LightTree {
    /// A tree over lights with positive power; `lights` pairs each with its index.
    pub(super) fn new(mut lights: Vec<Entry>, n_lights: usize) -> Self {
        lights.retain(|(_, b)| b.power > 0.0 && b.power.is_finite() && !b.bounds.is_empty());
        let most = lights.iter().map(|(_, b)| b.power).fold(0.0, f32::max);
        let power_unit = power_of_two_below(most);
        for (_, b) in &mut lights {
            b.power = (b.power / power_unit).max(f32::MIN_POSITIVE);
        }
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * lights.len()),
            power_unit,
            trails: vec![0; n_lights],
        };
        if !lights.is_empty() {
            tree.build(&mut lights, 0, 0);
        }
        tree
    }

    /// Whether there is no light in it.
    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Bytes held.
    pub(super) fn n_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.trails[..])
    }

    /// A bound on the irradiance of all lights at `p` on a surface with unit normal `n`, in units
    /// of power per area; at most [`MAX_IMPORTANCE`].
    pub(super) fn importance(&self, p: Vec3, n: Vec3) -> f32 {
        let importance = self.nodes.first().map_or(0.0, |root| root.importance(p, n));
        (importance * self.power_unit).min(MAX_IMPORTANCE)
    }

    /// Goes on with a walk to a light; `u` is in [0, 1).
    pub(super) fn sample(
        &self,
        p: Vec3,
        n: Vec3,
        mut u: f32,
        walk: &mut impl LightWalk,
    ) -> Option<u32> {
        let mut node = self.nodes.first()?;
        let mut idx = 0;
        while !node.is_leaf {
            let first = self.first_child_probability(idx, p, n)?;
            let is_second = walk.turn(idx as u32, first, |first| takes_second(&mut u, first));
            idx = if is_second {
                node.link as usize
            } else {
                idx + 1
            };
            node = &self.nodes[idx];
        }
        Some(node.link)
    }

    /// Goes on with the walk that finds a light; whether there is one.
    pub(super) fn follow(&self, p: Vec3, n: Vec3, light: u32, walk: &mut impl LightWalk) -> bool {
        let mut trail = self.trails[light as usize];
        let mut idx = 0;
        while let Some(node) = self.nodes.get(idx) {
            if node.is_leaf {
                return node.link == light;
            }
            let Some(first) = self.first_child_probability(idx, p, n) else {
                return false;
            };
            idx = if walk.turn(idx as u32, first, |_| trail & 1 == 1) {
                node.link as usize
            } else {
                idx + 1
            };
            trail >>= 1;
        }
        false
    }

    /// What a walk finds at a node; none where no light behind it can contribute.
    pub(super) fn step(&self, idx: usize, p: Vec3, n: Vec3) -> Option<TreeStep> {
        let node = self.nodes.get(idx)?;
        if node.is_leaf {
            return Some(TreeStep::Light(node.link));
        }
        let first = self.first_child_probability(idx, p, n)?;
        let children = [idx + 1, node.link as usize];
        Some(TreeStep::Fork { first, children })
    }

    /// Forks have numbers below this.
    pub(super) fn n_forks(&self) -> u32 {
        self.nodes.len() as u32
    }

    /// Probability of the first child of an inner node; None where neither child can contribute.
    #[inline]
    fn first_child_probability(&self, idx: usize, p: Vec3, n: Vec3) -> Option<f32> {
        let first = self.nodes[idx + 1].importance(p, n);
        let second = self.nodes[self.nodes[idx].link as usize].importance(p, n);
        let sum = first + second;
        (sum > 0.0).then(|| first / sum)
    }

    fn build(&mut self, lights: &mut [Entry], trail: u64, depth: u32) -> usize {
        let all = lights
            .iter()
            .map(|(_, b)| *b)
            .reduce(|a, b| a.union(&b))
            .expect("a node has at least one light");
        let idx = self.nodes.len();
        self.nodes.push(Node::new(&all));
        if let [(light, _)] = lights {
            self.nodes[idx].is_leaf = true;
            self.nodes[idx].link = *light;
            self.trails[*light as usize] = trail;
            return idx;
        }
        let (first, second) = split(lights, &all, depth);
        self.build(first, trail, depth + 1);
        let second_idx = self.build(second, trail | (1 << depth), depth + 1);
        self.nodes[idx].link = second_idx as u32;
        idx
    }
}

impl LightBounds {
    fn centroid(&self) -> Vec3 {
        self.bounds.center()
    }

    fn union(&self, other: &Self) -> Self {
        let (axis, cos_normals) = union_of_cones(
            (self.axis, self.cos_normals),
            (other.axis, other.cos_normals),
        );
        Self {
            bounds: self.bounds.union(&other.bounds),
            power: self.power + other.power,
            axis,
            cos_normals,
            cos_emission: self.cos_emission.min(other.cos_emission),
            is_two_sided: self.is_two_sided | other.is_two_sided,
        }
    }

    /// The orientation measure M_Ω of Conty Estevez & Kulla.
    fn orientation_measure(&self) -> f32 {
        let normals = self.cos_normals.clamp(-1.0, 1.0).acos();
        let reach = (normals + self.cos_emission.clamp(-1.0, 1.0).acos()).min(PI);
        2.0 * PI * (1.0 - self.cos_normals)
            + FRAC_PI_2
                * (2.0 * reach * normals.sin()
                    - (normals - 2.0 * reach).cos()
                    - 2.0 * normals * normals.sin()
                    + self.cos_normals)
    }

    fn cost(&self, max_extent: f32, extent: f32) -> f32 {
        self.power
            * self.orientation_measure()
            * (max_extent / extent)
            * self.bounds.half_area().max(f32::MIN_POSITIVE)
    }
}

/// Splits by the surface area orientation heuristic over twelve buckets an axis, or in the middle
/// where it finds nothing or the tree has grown too deep.
fn split<'a>(
    lights: &'a mut [Entry],
    all: &LightBounds,
    depth: u32,
) -> (&'a mut [Entry], &'a mut [Entry]) {
    const N_BUCKETS: usize = 12;
    let centroids = Bounds3::from_points(lights.iter().map(|(_, b)| b.centroid()));
    let bucket_of = |b: &LightBounds, axis: usize| {
        let t = (b.centroid()[axis] - centroids.min[axis]) / centroids.diagonal()[axis];
        ((t * N_BUCKETS as f32) as usize).min(N_BUCKETS - 1)
    };
    let diagonal = all.bounds.diagonal();
    let mut best: Option<(f32, usize, usize)> = None;
    if depth < MAX_UNBALANCED_DEPTH {
        for axis in (0..3).filter(|&axis| centroids.diagonal()[axis] > 0.0) {
            let mut buckets: [Option<LightBounds>; N_BUCKETS] = [None; N_BUCKETS];
            for (_, b) in lights.iter() {
                let bucket = &mut buckets[bucket_of(b, axis)];
                *bucket = Some(bucket.map_or(*b, |other| other.union(b)));
            }
            let union_of = |range: &[Option<LightBounds>]| {
                range.iter().flatten().copied().reduce(|a, b| a.union(&b))
            };
            for cut in 1..N_BUCKETS {
                let (Some(low), Some(high)) =
                    (union_of(&buckets[..cut]), union_of(&buckets[cut..]))
                else {
                    continue;
                };
                let (max_extent, extent) = (diagonal.max_element(), diagonal[axis]);
                let cost = low.cost(max_extent, extent) + high.cost(max_extent, extent);
                if best.is_none_or(|(lowest, ..)| cost < lowest) {
                    best = Some((cost, axis, cut));
                }
            }
        }
    }
    let middle = match best {
        Some((_, axis, cut)) => {
            // A stable partition keeps the tree independent of anything but the lights.
            lights.sort_by_key(|(_, b)| bucket_of(b, axis) >= cut);
            lights.partition_point(|(_, b)| bucket_of(b, axis) < cut)
        }
        None => lights.len() / 2,
    };
    lights.split_at_mut(middle)
}

impl Node {
    fn new(all: &LightBounds) -> Self {
        Self {
            center: all.bounds.center(),
            radius_sq: 0.25 * all.bounds.diagonal().length_squared(),
            axis: all.axis,
            power: all.power,
            cos_normals: all.cos_normals,
            sin_normals: sin_from_cos(all.cos_normals),
            cos_emission: all.cos_emission,
            is_two_sided: all.is_two_sided,
            is_leaf: false,
            link: 0,
        }
    }

    /// A bound on the irradiance at `p`: power over squared distance, times the cosines of the
    /// smallest angles that some emitted direction, and some direction to the box, can make.
    #[inline]
    fn importance(&self, p: Vec3, n: Vec3) -> f32 {
        let from_center = p - self.center;
        let distance_sq = from_center.length_squared();
        let wi = from_center / distance_sq.sqrt().max(f32::MIN_POSITIVE);
        // The angle the box fills.
        let (sin_box, cos_box) = if distance_sq <= self.radius_sq {
            (0.0, -1.0)
        } else {
            let sin_sq = self.radius_sq / distance_sq;
            (sin_sq.sqrt(), (1.0 - sin_sq).sqrt())
        };
        let mut cos_axis = self.axis.dot(wi);
        if self.is_two_sided {
            cos_axis = cos_axis.abs();
        }
        let (sin_x, cos_x) = angle_difference(
            (sin_from_cos(cos_axis), cos_axis),
            (self.sin_normals, self.cos_normals),
        );
        let (_, cos_emitted) = angle_difference((sin_x, cos_x), (sin_box, cos_box));
        if cos_emitted <= self.cos_emission {
            return 0.0;
        }
        let cos_incident = wi.dot(n).abs();
        let (_, cos_received) = angle_difference(
            (sin_from_cos(cos_incident), cos_incident),
            (sin_box, cos_box),
        );
        (self.power * cos_emitted * cos_received / distance_sq.max(self.radius_sq)).max(0.0)
    }
}

/// The greatest power of two that is not above a positive number.
fn power_of_two_below(x: f32) -> f32 {
    const EXPONENT: u32 = 0xff << 23;
    f32::from_bits(x.max(f32::MIN_POSITIVE).to_bits() & EXPONENT)
}

/// Sine and cosine of max(0, a − b).
#[inline]
fn angle_difference((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> (f32, f32) {
    if cos_a > cos_b {
        return (0.0, 1.0);
    }
    (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b)
}

#[inline]
fn sin_from_cos(cos: f32) -> f32 {
    (1.0 - cos * cos).max(0.0).sqrt()
}

/// The smallest cone around two cones, each an axis and the cosine of a half angle.
fn union_of_cones(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (theta_a, theta_b) = (a.1.clamp(-1.0, 1.0).acos(), b.1.clamp(-1.0, 1.0).acos());
    let between = a.0.dot(b.0).clamp(-1.0, 1.0).acos();
    if (between + theta_b).min(PI) <= theta_a {
        return a;
    }
    if (between + theta_a).min(PI) <= theta_b {
        return b;
    }
    let theta = 0.5 * (theta_a + between + theta_b);
    let turn = a.0.cross(b.0);
    if theta >= PI || turn.length_squared() < 1e-12 {
        return (a.0, -1.0);
    }
    // Turn the first axis toward the second.
    let perpendicular = turn.normalize().cross(a.0);
    let (sin, cos) = (theta - theta_a).sin_cos();
    ((a.0 * cos + perpendicular * sin).normalize(), theta.cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::walk::ImportanceWalk;
    use kilauea_math::hash::{mix32, unit_f32};

    fn probability(tree: &LightTree, p: Vec3, n: Vec3, light: u32) -> f32 {
        let mut walk = ImportanceWalk::START;
        let is_found = tree.follow(p, n, light, &mut walk);
        if is_found { walk.probability() } else { 0.0 }
    }

    fn number(i: u32) -> f32 {
        unit_f32(mix32(i))
    }

    fn scattered(n: u32) -> Vec<(u32, LightBounds)> {
        (0..n)
            .map(|i| {
                let p = 10.0 * Vec3::new(number(7 * i), number(7 * i + 1), number(7 * i + 2));
                let axis = Vec3::new(number(7 * i + 3), number(7 * i + 4), number(7 * i + 5)) - 0.5;
                let bounds = LightBounds {
                    bounds: Bounds3::from_points([p, p + 0.1]),
                    power: 0.1 + number(7 * i + 6),
                    axis: axis.normalize_or(Vec3::Z),
                    cos_normals: 1.0,
                    cos_emission: 0.0,
                    is_two_sided: i % 3 == 0,
                };
                (i, bounds)
            })
            .collect()
    }

    #[test]
    fn probabilities_agree_with_sampling_and_sum_to_one() {
        for n in [1, 2, 3, 50, 1000] {
            let tree = LightTree::new(scattered(n), n as usize);
            let (p, normal) = (Vec3::new(3.0, -1.0, 4.0), Vec3::new(0.6, 0.8, 0.0));
            let sum: f32 = (0..n).map(|i| probability(&tree, p, normal, i)).sum();
            // Mass is lost only where a descent ends at two children that cannot contribute.
            assert!(sum <= 1.0 + 1e-4 && (sum > 0.9 || n < 3), "{n}: {sum}");
            for k in 0..200 {
                let mut walk = ImportanceWalk::START;
                let u = (k as f32 + 0.5) / 200.0;
                if let Some(light) = tree.sample(p, normal, u, &mut walk) {
                    let (drawn, other) = (walk.probability(), probability(&tree, p, normal, light));
                    assert!((drawn - other).abs() <= 1e-5 * other, "{drawn} {other}");
                }
            }
        }
    }

    #[test]
    fn a_light_that_lights_a_point_can_be_chosen_there() {
        let lights = scattered(300);
        let tree = LightTree::new(lights.clone(), 300);
        for k in 0..100 {
            let p = 12.0 * Vec3::new(number(9000 + k), number(9100 + k), number(9200 + k)) - 1.0;
            let n =
                (Vec3::new(number(9300 + k), number(9400 + k), number(9500 + k)) - 0.5).normalize();
            for (light, b) in &lights {
                let to_p = (p - b.bounds.center()).normalize();
                let cos = b.axis.dot(to_p);
                let emits = cos > 1e-3 || (b.is_two_sided && cos < -1e-3);
                if emits && to_p.dot(n).abs() > 1e-3 {
                    assert!(probability(&tree, p, n, *light) > 0.0, "{light} at {p}");
                }
            }
        }
    }

    #[test]
    fn near_and_bright_lights_are_preferred() {
        let lights = scattered(2000);
        let tree = LightTree::new(lights.clone(), 2000);
        let (p, n) = (Vec3::splat(5.0), Vec3::Y);
        // Second moments of the estimator of total irradiance.
        let irradiance = |b: &LightBounds| {
            let d = p - b.bounds.center();
            let cos = b.axis.dot(d.normalize());
            let cos = if b.is_two_sided {
                cos.abs()
            } else {
                cos.max(0.0)
            };
            b.power * cos * (d.normalize().dot(n)).abs() / d.length_squared()
        };
        let (mut by_tree, mut uniform, mut total) = (0.0, 0.0, 0.0);
        for (light, b) in &lights {
            let e = irradiance(b);
            if e > 0.0 {
                by_tree += e * e / probability(&tree, p, n, *light);
                uniform += e * e * lights.len() as f32;
                total += e;
            }
        }
        // No choice has less than the squared total; the tree must come within a factor of two,
        // where uniform choice is far off.
        let least = total * total;
        assert!(uniform > 5.0 * least, "{uniform} {least}");
        assert!(by_tree < 2.0 * least, "{by_tree} {least}");
    }

    #[test]
    fn identical_lights_do_not_overflow_the_trail() {
        let one = scattered(1)[0].1;
        let tree = LightTree::new((0..5000).map(|i| (i, one)).collect(), 5000);
        let sum: f32 = (0..5000)
            .map(|i| probability(&tree, -Vec3::ONE, Vec3::Z, i))
            .sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    }
}
