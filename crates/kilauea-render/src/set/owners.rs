//! Who holds what: chunks at random, so that what is close together, and is met by the same rays, is
//! far apart (Kato & Saito 2002, section 3); and evenly by bytes.

use std::cmp::Reverse;

use kilauea_math::hash::combine;
use kilauea_scene::Scene;
use serde::{Deserialize, Serialize};

use super::units::{Unit, units};
use crate::caustics::PhotonDemand;
use crate::geometry::ChunkId;

/// Most members of a set: larger ones ask so many for each ray that several sets are better.
const MAX_MEMBERS: usize = 64;

/// A scene that cannot be spread.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlacementError {
    /// A chunk is larger than any member.
    #[error(
        "{path}: a chunk takes {bytes} bytes with its trees, and no member of the set has room for \
         more than {largest}: give members more memory, or cut chunks smaller"
    )]
    Chunk {
        /// The prim.
        path: String,
        /// What it takes.
        bytes: u64,
        /// Memory of the largest member.
        largest: u64,
    },
    /// All members together are too small.
    #[error(
        "the scene takes {bytes} bytes with its trees{}, more than the {n_members} members that there \
         are can hold, of {room} bytes together",
        beside(*.photons)
    )]
    Scene {
        /// What the scene takes.
        bytes: u64,
        /// Members tried.
        n_members: usize,
        /// Memory of all members.
        room: u64,
        /// What a member of them all has to have for photons.
        photons: u64,
    },
    /// A set of no members, or of too many.
    #[error("a set has 1 to {MAX_MEMBERS} members, not {0}")]
    Size(usize),
}

/// What the photons of a member are said to add to a scene.
fn beside(photons: u64) -> String {
    if photons == 0 {
        return String::new();
    }
    format!(", and its caustic photons up to {photons} bytes on each member")
}

/// Which member of a set holds which chunk.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetPlan {
    /// By prototype and chunk.
    owners: Vec<Vec<u8>>,
    /// Bytes by member.
    bytes: Vec<u64>,
}

impl SetPlan {
    /// Spreads a scene evenly over so many members, however much memory they have.
    ///
    /// # Errors
    /// If a set cannot have so many.
    pub fn even(scene: &Scene, n_members: usize) -> Result<Self, PlacementError> {
        if !(1..=MAX_MEMBERS).contains(&n_members) {
            return Err(PlacementError::Size(n_members));
        }
        let units = units(scene);
        let total = units.iter().map(|unit| unit.bytes).sum::<u64>().max(1);
        let rooms = vec![total; n_members];
        Ok(Self::fill(scene, &units, &rooms).expect("each member has room for all"))
    }

    /// Spreads a scene over as few members as can hold it, the largest first. `memory_bytes` is what
    /// each has for chunks, their trees and photons.
    ///
    /// # Errors
    /// If a chunk is larger than any member, or the scene than all of them.
    pub fn smallest(
        scene: &Scene,
        memory_bytes: &[u64],
        photons: PhotonDemand,
    ) -> Result<Self, PlacementError> {
        let mut rooms = memory_bytes.to_vec();
        rooms.sort_unstable_by_key(|&room| Reverse(room));
        rooms.truncate(MAX_MEMBERS);
        let largest = *rooms.first().ok_or(PlacementError::Size(0))?;
        let units = units(scene);
        if let Some(unit) = units.iter().find(|unit| unit.bytes > largest) {
            return Err(PlacementError::Chunk {
                path: scene.prim_path(prim_of(scene, unit.id)).to_owned(),
                bytes: unit.bytes,
                largest,
            });
        }
        let sizes = 1..=rooms.len();
        let mut plans = sizes.filter_map(|n| {
            let beside_photons = |room: &u64| room.saturating_sub(photons.of_member(n));
            let rooms: Vec<u64> = rooms[..n].iter().map(beside_photons).collect();
            Self::fill(scene, &units, &rooms)
        });
        plans.next().ok_or_else(|| PlacementError::Scene {
            bytes: units.iter().map(|unit| unit.bytes).sum(),
            n_members: rooms.len(),
            room: rooms.iter().sum(),
            photons: photons.of_member(rooms.len()),
        })
    }

    /// Members of the set.
    pub fn n_members(&self) -> usize {
        self.bytes.len()
    }

    /// Estimated bytes of each member's chunks and trees.
    pub fn bytes(&self) -> &[u64] {
        &self.bytes
    }

    /// Whether each of so many chunks, by prototype, has an owner that there is.
    pub(super) fn fits(&self, n_chunks: impl Iterator<Item = usize>) -> bool {
        let mut owners = self.owners.iter().flatten();
        n_chunks.eq(self.owners.iter().map(Vec::len))
            && self.n_members() <= MAX_MEMBERS
            && owners.all(|&owner| usize::from(owner) < self.n_members())
    }

    pub(crate) fn owner(&self, chunk: ChunkId) -> usize {
        self.owners[chunk.prototype as usize][chunk.chunk as usize].into()
    }

    /// Gives each unit to the member that is least full, large ones first and otherwise in an order
    /// by chance, so that neighbours in the scene have nothing to do with each other. None where
    /// one finds no room.
    fn fill(scene: &Scene, units: &[Unit], rooms: &[u64]) -> Option<Self> {
        let mut in_order: Vec<&Unit> = units.iter().collect();
        in_order.sort_by_key(|unit| {
            let ChunkId { prototype, chunk } = unit.id;
            (
                Reverse(unit.bytes.max(1).ilog2()),
                combine(prototype, chunk),
                unit.id,
            )
        });
        let mut plan = Self {
            owners: scene
                .prototypes
                .iter()
                .map(|p| vec![0; p.n_chunks()])
                .collect(),
            bytes: vec![0; rooms.len()],
        };
        for unit in in_order {
            // Fullness after, in the ratio of room: a / b < c / d without division.
            let fullness = |member: usize| plan.bytes[member] + unit.bytes;
            let fits = |&member: &usize| fullness(member) <= rooms[member];
            let least_full = (0..rooms.len()).filter(fits).min_by(|&a, &b| {
                let cross =
                    |m: usize, other: usize| u128::from(fullness(m)) * u128::from(rooms[other]);
                cross(a, b).cmp(&cross(b, a))
            })?;
            plan.bytes[least_full] += unit.bytes;
            let ChunkId { prototype, chunk } = unit.id;
            plan.owners[prototype as usize][chunk as usize] = least_full as u8;
        }
        Some(plan)
    }
}

/// The prim that a chunk is of.
fn prim_of(scene: &Scene, id: ChunkId) -> u32 {
    let prototype = &scene.prototypes[id.prototype as usize];
    let meshes = prototype.chunks.iter().map(|c| c.prim_idx);
    let points = prototype.points.iter().map(|c| c.prim_idx);
    let curves = prototype.curves.iter().map(|c| c.prim_idx);
    let mut all = meshes.chain(points).chain(curves);
    all.nth(id.chunk as usize).unwrap_or(u32::MAX)
}
