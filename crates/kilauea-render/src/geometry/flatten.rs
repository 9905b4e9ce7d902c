//! The prototype graph as a list of placements.

use std::collections::BTreeMap;

use kilauea_accel::Placement;
use kilauea_math::DAffine3;
use kilauea_scene::{InstanceAttribute, Prototype, Scene, Visibility};
use kilauea_shading::{ElementCounts, PrimvarLayout, PrimvarSlot};
use shaders::Shader;

use super::accel_input::accel_visibility;
use super::keys::TransformKeys;
use super::placed::{Placed, PlacedMotion};

/// All placements of all prototypes that have surfaces.
pub(super) struct Flattened {
    pub(super) placements: Vec<Placed>,
    pub(super) accel_placements: Vec<Placement>,
    /// Primvar slots, by [`Placed::first_slots`] plus the chunk's number in its prototype.
    pub(super) slots: Vec<Box<[PrimvarSlot]>>,
    pub(super) n_instances: i32,
}

/// Walks from the world to everything that it places.
pub(super) fn flatten(scene: &Scene, shaders: &[Shader]) -> Flattened {
    let mut walk = Walk {
        scene,
        shaders,
        slots_of: BTreeMap::new(),
        out: Flattened {
            placements: Vec::new(),
            accel_placements: Vec::new(),
            slots: Vec::new(),
            n_instances: 0,
        },
    };
    let engine_from_world = DAffine3::from_translation(-scene.origin_world);
    let world = Outside {
        engine_from_prototype: TransformKeys::Still(engine_from_world),
        attributes: None,
        visibility: Visibility::ALL,
        instance_id: -1,
    };
    walk.place(0, &world);
    walk.out
}

/// What a placement brings to its prototype.
struct Outside {
    engine_from_prototype: TransformKeys,
    attributes: Option<(u32, u32, u32)>,
    visibility: Visibility,
    instance_id: i32,
}

struct Walk<'a> {
    scene: &'a Scene,
    shaders: &'a [Shader],
    /// First slots of a prototype under the per-instance primvars of an instancer.
    slots_of: BTreeMap<(u32, Option<(u32, u32)>), u32>,
    out: Flattened,
}

impl Walk<'_> {
    fn place(&mut self, prototype_idx: u32, outside: &Outside) {
        let scene = self.scene;
        let prototype = &scene.prototypes[prototype_idx as usize];
        if !prototype.has_no_surfaces() {
            self.add(prototype_idx, prototype, outside);
        }
        for (group_idx, group) in prototype.instances.iter().enumerate() {
            for (idx, &first) in group.parent_from_prototype.iter().enumerate() {
                // The nearest instancer that has per-instance primvars decides.
                let own = (!group.attributes.is_empty()).then_some((
                    prototype_idx,
                    group_idx as u32,
                    idx as u32,
                ));
                let later = &group.later_parent_from_prototype;
                let parent_from_prototype = TransformKeys::of_instance(first, later, idx);
                let inside = Outside {
                    engine_from_prototype: outside
                        .engine_from_prototype
                        .after(&parent_from_prototype),
                    attributes: own.or(outside.attributes),
                    visibility: outside.visibility & group.visibility,
                    instance_id: self.out.n_instances,
                };
                self.out.n_instances += 1;
                self.place(group.prototype, &inside);
            }
        }
    }

    fn add(&mut self, prototype_idx: u32, prototype: &Prototype, outside: &Outside) {
        let to_center = TransformKeys::Still(DAffine3::from_translation(prototype.center));
        let engine_from_chunk = outside.engine_from_prototype.after(&to_center);
        let first_slots = self.slots_for(prototype_idx, outside.attributes);
        self.out.placements.push(Placed {
            prototype: prototype_idx,
            motion: PlacedMotion::new(&engine_from_chunk),
            first_slots,
            attributes: outside.attributes,
            visibility: outside.visibility,
            instance_id: outside.instance_id,
        });
        self.out.accel_placements.push(Placement {
            geometry: prototype_idx,
            world_from_geometry: engine_from_chunk.keys()[0],
            motion: match engine_from_chunk {
                TransformKeys::Still(_) => None,
                TransformKeys::Moving(keys) => Some(keys),
            },
            visibility: accel_visibility(outside.visibility),
        });
    }

    fn slots_for(&mut self, prototype_idx: u32, attributes: Option<(u32, u32, u32)>) -> u32 {
        let group = attributes.map(|(prototype, instances, _)| (prototype, instances));
        if let Some(&first) = self.slots_of.get(&(prototype_idx, group)) {
            return first;
        }
        let instance_attributes: &[InstanceAttribute] = match group {
            None => &[],
            Some((prototype, instances)) => {
                &self.scene.prototypes[prototype as usize].instances[instances as usize].attributes
            }
        };
        let first = self.out.slots.len() as u32;
        let prototype = &self.scene.prototypes[prototype_idx as usize];
        let meshes = prototype.chunks.iter();
        let meshes = meshes.map(|c| (c.material, &c.attributes, ElementCounts::from(c)));
        let points = prototype.points.iter();
        let points = points.map(|c| (c.material, &c.attributes, ElementCounts::from(c)));
        let curves = prototype.curves.iter();
        let curves = curves.map(|c| (c.material, &c.attributes, ElementCounts::from(c)));
        for (material, attributes, counts) in meshes.chain(points).chain(curves) {
            let names = self.shaders[material as usize].primvars();
            let slots = PrimvarLayout::resolve(names, attributes, counts, instance_attributes);
            self.out.slots.push(slots.into_boxed_slice());
        }
        self.slots_of.insert((prototype_idx, group), first);
        first
    }
}
