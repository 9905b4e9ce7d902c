//! Where chunks are, for those who do not have them.

use std::collections::BTreeMap;

use kilauea_accel::{BoxTree, Ray};
use kilauea_math::Bounds3;
use kilauea_scene::Visibility;

use super::ask::Whom;
use super::outline::ChunkOutlines;
use super::owners::SetPlan;
use crate::geometry::{ChunkId, Geometry};

/// Boxes around pieces of all placed chunks, with who holds what is inside.
pub(super) struct ChunkBoxes {
    tree: BoxTree,
    entries: Vec<Entry>,
    /// By unit: what is placed together, of any number of boxes.
    unit_bytes: Vec<u64>,
    n_members: usize,
}

/// Chunks of one placement, one member and one visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    owner: u8,
    met_by: Visibility,
    unit: u32,
}

impl ChunkBoxes {
    /// Boxes of the chunks of a whole scene, placed as `geometry` has it.
    ///
    /// Prototypes that are placed once have a box for each piece of a chunk. The others have one for
    /// each placement and member, so that there are no more boxes than placements of parts.
    pub(super) fn new(chunks: &ChunkOutlines, geometry: &Geometry, plan: &SetPlan) -> Self {
        let mut n_placed = vec![0_u32; chunks.bounds.len()];
        let placements = 0..geometry.n_placements() as u32;
        for placement in placements.clone() {
            n_placed[geometry.prototype_of(placement) as usize] += 1;
        }
        let mut boxes = Vec::new();
        let mut entries: Vec<Entry> = Vec::new();
        let mut bytes = chunks.bytes.clone();
        let mut unit_numbers = BTreeMap::new();
        let mut unit_bytes = Vec::new();
        for placement in placements {
            let prototype = geometry.prototype_of(placement);
            let begin = entries.len();
            for (chunk, pieces) in (0..).zip(&chunks.bounds[prototype as usize]) {
                let visibility = geometry.chunk_visibility(placement, chunk);
                let pieces = pieces.iter().filter(|bounds| !bounds.is_empty());
                if visibility.is_none() || pieces.clone().next().is_none() {
                    continue;
                }
                let id = ChunkId { prototype, chunk };
                let owner = plan.owner(id);
                let is_shared = n_placed[prototype as usize] > 1;
                let of_unit = (prototype, if is_shared { Err(owner) } else { Ok(chunk) });
                let unit = *unit_numbers.entry(of_unit).or_insert_with(|| {
                    unit_bytes.push(0);
                    unit_bytes.len() as u32 - 1
                });
                // A chunk counts once, however often it is placed.
                unit_bytes[unit as usize] +=
                    std::mem::take(&mut bytes[prototype as usize][chunk as usize]);
                let entry = Entry {
                    owner: owner as u8,
                    met_by: visibility,
                    unit,
                };
                for bounds in pieces {
                    let placed = geometry.placed_bounds(placement, bounds);
                    let same = entries[begin..].iter().position(|other| *other == entry);
                    if let Some(idx) = same.filter(|_| is_shared) {
                        let all: &mut Bounds3 = &mut boxes[begin + idx];
                        *all = all.union(&placed);
                    } else {
                        boxes.push(placed);
                        entries.push(entry);
                    }
                }
            }
        }
        Self {
            tree: BoxTree::build(&boxes),
            entries,
            unit_bytes,
            n_members: plan.n_members(),
        }
    }

    /// Members other than `own` whose chunks a ray may meet; none where that cannot be told.
    #[inline]
    pub(super) fn pierced(&self, ray: &Ray, own: Option<usize>) -> Option<Whom> {
        let all = Whom::first(self.n_members).without(own).0;
        let mut whom = 0_u64;
        let is_tested = self.tree.visit_pierced(ray, |idx| {
            let entry = self.entries[idx as usize];
            if entry.met_by.0 & ray.visibility.0 != 0 {
                whom |= (1 << entry.owner) & all;
            }
            whom == all
        });
        is_tested.then_some(Whom(whom))
    }

    /// What is placed together and may be met by a ray, by number: what matters to sets of other
    /// sizes.
    pub(super) fn pierced_units(&self, ray: &Ray) -> Vec<u32> {
        let mut units = Vec::new();
        let _ = self.tree.visit_pierced(ray, |idx| {
            let entry = self.entries[idx as usize];
            if entry.met_by.0 & ray.visibility.0 != 0 {
                units.push(entry.unit);
            }
            false
        });
        units.sort_unstable();
        units.dedup();
        units
    }

    /// Bytes of each unit.
    pub(super) fn unit_bytes(&self) -> &[u64] {
        &self.unit_bytes
    }
}
