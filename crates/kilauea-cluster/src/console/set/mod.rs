//! Sets of workers: which worker has which part of the scene, and who is told of whom.

mod parts;

use std::ops::Range;

use kilauea_render::{PhotonDemand, PhotonRoom, RenderStats, SetPlan};
use kilauea_scene::{RenderSettings, Scene};

use super::Console;
use super::peer::Stage;
use crate::error::ClusterError;
use crate::ledger::Holder;
use crate::options::{ClusterOptions, SetOptions, SetSize};
use crate::protocol::{MemberAddress, Members, Message};
use crate::stats::SeatStats;
pub(super) use parts::Parts;

/// How workers are divided into sets: those of consecutive ranks are one.
#[derive(Clone, Debug)]
pub(super) struct Sets {
    pub(super) plan: SetPlan,
    pub(super) options: SetOptions,
    /// Workers of a set.
    size: u32,
    /// For photons, where it is said how much memory members have.
    photon_room: Option<PhotonRoom>,
}

impl Sets {
    /// The sets that are asked for; none where each worker has the whole scene.
    pub(super) fn of(
        scene: &Scene,
        settings: &RenderSettings,
        options: &ClusterOptions,
    ) -> Result<Option<Self>, ClusterError> {
        let n_workers = options.n_workers;
        let Some(set) = options.set else {
            return Ok(None);
        };
        let photons = PhotonDemand::of(scene, settings);
        let size = match set.size {
            SetSize::Workers(size) => size,
            SetSize::Memory(bytes) => {
                let rooms = vec![bytes; n_workers as usize];
                let smallest = SetPlan::smallest(scene, &rooms, photons)?.n_members() as u32;
                // Nobody is left over.
                let mut sizes = smallest..=n_workers;
                sizes
                    .find(|&n| n_workers.is_multiple_of(n))
                    .unwrap_or(smallest)
            }
        };
        if size == 1 {
            return Ok(None);
        }
        let plan = SetPlan::even(scene, size as usize)?;
        if !n_workers.is_multiple_of(size) {
            return Err(ClusterError::SetSize { n_workers, size });
        }
        let fullest = plan.bytes().iter().max().copied().unwrap_or(0);
        let photon_room = match set.size {
            SetSize::Workers(_) => None,
            SetSize::Memory(bytes) => Some(PhotonRoom {
                left: bytes.saturating_sub(fullest),
                planned: photons.of_member(size as usize),
            }),
        };
        Ok(Some(Self {
            plan,
            options: set,
            size,
            photon_room,
        }))
    }

    /// Number of a worker in its set.
    pub(super) fn number(&self, rank: u32) -> u32 {
        rank % self.size
    }

    /// Ranks of the set that a worker is in.
    fn ranks(&self, rank: u32) -> Range<u32> {
        let first = rank - self.number(rank);
        first..first + self.size
    }

    /// A worker's place.
    pub(super) fn seat(&self, rank: u32) -> SeatStats {
        SeatStats {
            set: rank / self.size,
            member: self.number(rank),
            ..SeatStats::default()
        }
    }
}

impl Console {
    /// Tells the members of a set who of them is there to answer: when one is ready, and when one is
    /// gone.
    pub(super) fn tell_set_of(&mut self, rank: u32) {
        let Some(sets) = &self.sets else { return };
        let ranks = sets.ranks(rank);
        let of_set = || {
            let peers = self.peers.iter();
            peers.filter(|(_, peer)| ranks.contains(&peer.holder.rank))
        };
        let members = of_set().filter_map(|(&epoch, peer)| {
            Some(MemberAddress {
                number: sets.number(peer.holder.rank),
                epoch,
                address: peer.address.clone()?,
            })
        });
        let members = Members {
            members: members.collect(),
        };
        for (&epoch, peer) in of_set() {
            if matches!(peer.stage, Stage::Working(_)) {
                // One that takes nothing more is found out as any other.
                peer.send(members.frame(epoch, &[]));
            }
        }
    }

    /// Lets the others of a set go, which can render nothing without the worker of `rank`.
    pub(super) fn disband_set_of(&mut self, rank: u32) {
        let Some(sets) = &self.sets else { return };
        let (ranks, number) = (sets.ranks(rank), sets.number(rank));
        let of_set = self.peers.values().map(|peer| peer.holder);
        let others: Vec<Holder> = of_set.filter(|h| ranks.contains(&h.rank)).collect();
        for Holder { epoch, .. } in others {
            self.bury(epoch, &format!("member {number} of its set is lost"));
        }
    }
}

/// What all members of all sets say of the scene and of what they asked.
pub(super) fn merge_members(
    reports: &[(Holder, RenderStats)],
    sets: Option<&Sets>,
    report: &mut RenderStats,
) {
    let mut all = reports.iter().filter_map(|(_, stats)| stats.set.as_ref());
    let Some(first) = all.next() else { return };
    let mut merged = first.clone();
    all.for_each(|set| merged.add(set));
    report.memory.scene = merged.members.iter().map(|m| m.bytes.scene).sum();
    report.memory.accel = merged.members.iter().map(|m| m.bytes.accel).sum();
    merged.photon_room = sets.and_then(|sets| sets.photon_room);
    report.set = Some(merged);
}
