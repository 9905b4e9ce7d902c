use kilauea_math::{DAffine3, DVec3};

use crate::assemble::AssembleOptions;
use crate::bounds::DBounds;
use crate::instancing::Plan;
use crate::nearest::{PixelScale, nearest_placements};
use crate::payload::Payloads;
use crate::shape::Located;
use crate::surface::is_placeable;

/// Where each scene prototype lies.
pub(crate) struct Spaces {
    /// By scene prototype: what positions are relative to.
    pub(crate) centers: Vec<DVec3>,
    /// By scene prototype: placements that look largest.
    nearest: Vec<Vec<DAffine3>>,
    pixel_scale: PixelScale,
}

impl Spaces {
    pub(crate) fn new(
        plan: &Plan,
        located: &[Option<Located<'_>>],
        payloads: &Payloads<'_>,
        options: &AssembleOptions,
    ) -> Self {
        let mut own = vec![DBounds::EMPTY; plan.roots.len()];
        for shape in located.iter().flatten() {
            own[shape.root] = own[shape.root].union(&shape.root_bounds);
        }
        // Children come after their parents, so backwards all of them are known.
        let mut all = own.clone();
        for parent in (0..all.len()).rev() {
            for placed in &plan.instances[parent] {
                let child = all[placed.prototype as usize];
                for parent_from_child in placed.all_transforms() {
                    all[parent] = all[parent].union(&child.transformed(parent_from_child));
                }
            }
        }
        // The world's center is the origin of all that is traced, even if only instances are there.
        if own[0].is_empty() {
            own[0] = all[0];
        }
        let centers = own.iter().map(|b| {
            let center = b.center();
            if b.is_empty() || !is_placeable(center) {
                DVec3::ZERO
            } else {
                center
            }
        });
        let pixel_scale = PixelScale::new(&payloads.camera, options.resolution);
        Self {
            centers: centers.collect(),
            nearest: nearest_placements(&pixel_scale, &plan.instances, &all),
            pixel_scale,
        }
    }

    /// How many pixels a unit of a shape's space covers where it looks largest.
    pub(crate) fn pixels_per_unit(&self, located: &Located<'_>) -> f64 {
        self.nearest[located.root]
            .iter()
            .map(|world_from_root| {
                let world_from_shape = *world_from_root * located.root_from_shape;
                self.pixel_scale
                    .pixels_per_unit(&world_from_shape, &located.bounds)
            })
            .fold(0.0, f64::max)
    }
}
