//! Which area lights a ray may meet: a binary tree of boxes.

use kilauea_accel::Ray;
use kilauea_math::{Bounds3, Vec3A};

/// Boxes of area lights; a handful is simply listed.
#[derive(Clone, Debug, Default)]
pub(super) struct AreaBvh {
    nodes: Vec<Node>,
    /// Light indices in leaf order.
    lights: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds3,
    /// First entry of `lights` in a leaf; second child in an inner node.
    link: u32,
    /// Lights of a leaf; 0 in an inner node.
    n_lights: u32,
}

const MAX_LEAF: usize = 4;

impl AreaBvh {
    pub(super) fn new(bounds: &[Bounds3]) -> Self {
        let mut bvh = Self {
            nodes: Vec::new(),
            lights: (0..bounds.len() as u32).collect(),
        };
        if !bounds.is_empty() {
            let mut lights = std::mem::take(&mut bvh.lights);
            bvh.build(bounds, &mut lights, 0);
            bvh.lights = lights;
        }
        bvh
    }

    /// Calls `visit` with each light whose box the ray meets.
    #[inline]
    pub(super) fn for_each(&self, ray: &Ray, mut visit: impl FnMut(u32)) {
        let Some(root) = self.nodes.first() else {
            return;
        };
        let inv_dir = Vec3A::from(ray.dir).recip();
        if !meets(&root.bounds, ray, inv_dir) {
            return;
        }
        let mut stack = [0_u32; 64];
        let mut n_stacked = 1;
        while n_stacked > 0 {
            n_stacked -= 1;
            let idx = stack[n_stacked];
            let node = &self.nodes[idx as usize];
            if !meets(&node.bounds, ray, inv_dir) {
                continue;
            }
            if node.n_lights > 0 {
                let leaf = &self.lights[node.link as usize..][..node.n_lights as usize];
                for &light in leaf {
                    visit(light);
                }
            } else {
                stack[n_stacked] = node.link;
                stack[n_stacked + 1] = idx + 1;
                n_stacked += 2;
            }
        }
    }

    /// Halves the lights along the longest axis, so that the depth stays below the stack's.
    fn build(&mut self, bounds: &[Bounds3], lights: &mut [u32], first: u32) {
        let all = lights
            .iter()
            .fold(Bounds3::EMPTY, |all, &l| all.union(&bounds[l as usize]));
        let idx = self.nodes.len();
        self.nodes.push(Node {
            bounds: all,
            link: first,
            n_lights: lights.len() as u32,
        });
        if lights.len() <= MAX_LEAF {
            return;
        }
        let d = all.diagonal();
        let axis = if d.x >= d.y && d.x >= d.z {
            0
        } else if d.y >= d.z {
            1
        } else {
            2
        };
        let middle = lights.len() / 2;
        lights.sort_by(|&a, &b| {
            let center = |l: u32| bounds[l as usize].center()[axis];
            center(a).total_cmp(&center(b)).then(a.cmp(&b))
        });
        let (low, high) = lights.split_at_mut(middle);
        self.build(bounds, low, first);
        let second = self.nodes.len() as u32;
        self.build(bounds, high, first + middle as u32);
        self.nodes[idx].link = second;
        self.nodes[idx].n_lights = 0;
    }
}

/// Whether the ray meets the box, slightly enlarged so that rounding loses nothing.
#[inline]
fn meets(bounds: &Bounds3, ray: &Ray, inv_dir: Vec3A) -> bool {
    let origin = Vec3A::from(ray.origin);
    let a = (Vec3A::from(bounds.min) - origin) * inv_dir;
    let b = (Vec3A::from(bounds.max) - origin) * inv_dir;
    // 0 · ∞ can only lose a ray that lies within a face of the box, where no light is seen.
    let enter = a.min(b).max_element();
    let exit = a.max(b).min_element();
    enter.max(ray.t_min) <= exit.min(ray.t_max) * (1.0 + 1e-5) + 1e-30
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::Vec3;
    use kilauea_math::hash::{mix32, unit_f32};

    #[test]
    fn finds_every_box_that_a_loop_finds() {
        let number = |i: u32| unit_f32(mix32(i));
        let boxes: Vec<Bounds3> = (0..500)
            .map(|i| {
                let p = Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)) * 10.0;
                // Flat boxes, as rects have.
                Bounds3::from_points([p, p + Vec3::new(0.5, 0.5, 0.0)])
            })
            .collect();
        let bvh = AreaBvh::new(&boxes);
        let mut n_met = 0;
        for k in 0..500 {
            let dir = Vec3::new(number(5000 + k), number(6000 + k), number(7000 + k));
            let ray = Ray::new(Vec3::splat(-1.0), dir);
            let mut found = vec![false; boxes.len()];
            bvh.for_each(&ray, |light| found[light as usize] = true);
            for (b, found) in boxes.iter().zip(found) {
                let is_met = meets(b, &ray, Vec3A::from(ray.dir).recip());
                n_met += u32::from(is_met);
                assert!(!is_met || found);
            }
        }
        assert!(n_met > 50);
    }
}
