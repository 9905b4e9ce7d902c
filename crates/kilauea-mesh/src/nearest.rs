use kilauea_math::{DAffine3, DVec3};
use kilauea_scene::{Camera, Instances, Projection};

use crate::bounds::DBounds;

/// Placements remembered per prototype.
const MAX_PLACEMENTS: usize = 16;

/// How large things look from the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelScale {
    p_camera_world: DVec3,
    /// Pixels per scene unit: at distance one, or anywhere if orthographic.
    pixels_per_unit: f64,
    is_perspective: bool,
}

impl PixelScale {
    pub(crate) fn new(camera: &Camera, resolution: [u32; 2]) -> Self {
        let [left, bottom, right, top] = camera.screen_window;
        let per_axis = [
            f64::from(resolution[0]) / (right - left).abs(),
            f64::from(resolution[1]) / (top - bottom).abs(),
        ];
        let pixels_per_unit = per_axis.into_iter().filter(|x| x.is_finite());
        Self {
            p_camera_world: camera.world_from_camera.w_axis.truncate(),
            pixels_per_unit: pixels_per_unit.fold(0.0, f64::max),
            is_perspective: camera.projection == Projection::Perspective,
        }
    }

    /// Pixels that one unit of a space covers at most, somewhere in a box of that space; infinite
    /// where the camera is inside the box.
    pub(crate) fn pixels_per_unit(&self, world_from_space: &DAffine3, bounds: &DBounds) -> f64 {
        let m = world_from_space.matrix3;
        let scale = [m.x_axis, m.y_axis, m.z_axis]
            .map(DVec3::length)
            .into_iter()
            .fold(0.0, f64::max);
        let distance = if self.is_perspective {
            let world_bounds = bounds.transformed(world_from_space);
            world_bounds.distance(self.p_camera_world)
        } else {
            1.0
        };
        scale * self.pixels_per_unit / distance
    }
}

/// The placements of each prototype that look largest, as transforms to the world.
///
/// Exact up to `MAX_PLACEMENTS` placements; beyond, the largest of each nesting level are kept.
/// Parents come before what they place in `instances`; `bounds` are those of each prototype with
/// all that it places.
pub(crate) fn nearest_placements(
    scale: &PixelScale,
    instances: &[Vec<Instances>],
    bounds: &[DBounds],
) -> Vec<Vec<DAffine3>> {
    let mut nearest: Vec<Vec<(f64, DAffine3)>> = vec![Vec::new(); instances.len()];
    if let Some(world) = nearest.first_mut() {
        world.push((f64::INFINITY, DAffine3::IDENTITY));
    }
    for parent in 0..instances.len() {
        let outer = std::mem::take(&mut nearest[parent]);
        for placed in &instances[parent] {
            let child = placed.prototype as usize;
            for (_, world_from_parent) in &outer {
                for parent_from_child in &placed.parent_from_prototype {
                    let world_from_child = *world_from_parent * *parent_from_child;
                    let density = scale.pixels_per_unit(&world_from_child, &bounds[child]);
                    insert_largest(&mut nearest[child], density, world_from_child);
                }
            }
        }
        nearest[parent] = outer;
    }
    nearest
        .into_iter()
        .map(|list| list.into_iter().map(|(_, transform)| transform).collect())
        .collect()
}

/// Keeps a short list sorted from the largest down; the first of equals stays first.
fn insert_largest(list: &mut Vec<(f64, DAffine3)>, density: f64, transform: DAffine3) {
    let at = list.partition_point(|(d, _)| *d >= density);
    if at < MAX_PLACEMENTS {
        list.truncate(MAX_PLACEMENTS - 1);
        list.insert(at, (density, transform));
    }
}

#[cfg(test)]
pub(crate) mod tests {

    use kilauea_scene::Visibility;

    use super::*;

    #[test]
    fn pixels_shrink_with_distance_and_grow_with_scale() {
        let scale = PixelScale::new(&Camera::default(), [100, 50]);
        let mut unit = DBounds::EMPTY;
        unit.include(DVec3::splat(-1.0));
        unit.include(DVec3::splat(1.0));
        let at = |z: f64, s: f64| {
            let transform =
                DAffine3::from_translation(DVec3::Z * z) * DAffine3::from_scale(DVec3::splat(s));
            scale.pixels_per_unit(&transform, &unit)
        };
        assert!((at(-11.0, 1.0) - 10.0).abs() < 1e-9);
        assert!((at(-12.0, 2.0) - 20.0).abs() < 1e-9);
        assert_eq!(at(0.0, 1.0), f64::INFINITY);
    }

    #[test]
    fn the_nearest_of_many_placements_is_kept() {
        let mut unit = DBounds::EMPTY;
        unit.include(DVec3::ZERO);
        let shifts = |n: i32, step: f64| Instances {
            prim_idx: 0,
            prototype: 1,
            parent_from_prototype: (0..n)
                .map(|i| {
                    DAffine3::from_translation(DVec3::Z * -(1.0 + step * f64::from(i * 7 % n)))
                })
                .collect(),
            later_parent_from_prototype: Vec::new(),
            visibility: Visibility::ALL,
            attributes: Vec::new(),
        };
        let mut nested = shifts(50, 0.5);
        nested.prototype = 2;
        let instances = [vec![shifts(100, 10.0)], vec![nested], Vec::new()];
        let scale = PixelScale::new(&Camera::default(), [100, 100]);
        let nearest = nearest_placements(&scale, &instances, &[unit, unit, unit]);
        assert_eq!(nearest[1].len(), MAX_PLACEMENTS);
        assert_eq!(nearest[1][0].translation.z, -1.0);
        assert_eq!(nearest[2][0].translation.z, -2.0);
    }
}
