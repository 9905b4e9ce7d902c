//! Who renders what, and which results count.
//!
//! Every unit is done at least once and counts exactly once: it is lent until a deadline, lent again
//! where its worker died or is late, and the first result is taken. Later ones must be equal to it.
//! Times are passed in, so that tests make them.

use std::ops::Range;
use std::time::Duration;

use kilauea_render::Unit;

use crate::plan::Plan;
use crate::protocol::LeaseStart;
use crate::snapshot::UnitCounts;

/// A result in short: BLAKE3 of all that is in it.
pub(crate) type Digest = [u8; 32];

/// A worker in one of its lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Holder {
    /// Number of the worker.
    pub(crate) rank: u32,
    /// Its life, which no other worker's life shares.
    pub(crate) epoch: u32,
}

/// A unit that is lent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Grant {
    /// Of this lease.
    pub(crate) id: u64,
    /// What is lent.
    pub(crate) unit: Unit,
    /// What the worker needs for it.
    pub(crate) start: LeaseStart,
}

/// What a result is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It counts.
    First,
    /// It came too late, and is equal to the one that counts.
    Equal,
    /// It came too late, and one of two workers computes wrongly.
    Differs {
        /// The worker whose result counts; none where it was kept from an earlier run.
        from: Option<u32>,
    },
    /// Nobody holds that lease.
    Unknown,
}

/// The units of a frame.
#[derive(Debug)]
pub(crate) struct Ledger {
    plan: Plan,
    tiles: Vec<TileRecord>,
    next_lease: u64,
    /// Time that a worker has for a unit.
    patience: Duration,
    n_lent_again: u64,
    n_late_results: u64,
}

#[derive(Debug, Default)]
struct TileRecord {
    /// Passes whose results count.
    n_done: u32,
    /// Passes that have been lent at least once.
    n_lent: u32,
    /// The life that has the tile's sums.
    kept_by: Option<u32>,
    leases: Vec<LeaseRecord>,
    accepted: Vec<Accepted>,
}

#[derive(Debug)]
struct LeaseRecord {
    id: u64,
    holder: Holder,
    passes: Range<u32>,
    deadline: Duration,
}

#[derive(Debug)]
struct Accepted {
    passes: Range<u32>,
    digest: Digest,
    from: Option<u32>,
}

impl Ledger {
    /// A ledger in which nothing is done. `patience` is the time that a worker has for a unit before
    /// others may have it too.
    pub(crate) fn new(plan: Plan, patience: Duration) -> Self {
        let tiles = (0..plan.n_tiles).map(|_| TileRecord::default()).collect();
        Self {
            plan,
            tiles,
            next_lease: 1,
            patience,
            n_lent_again: 0,
            n_late_results: 0,
        }
    }

    /// Whether every unit has a result.
    pub(crate) fn is_complete(&self) -> bool {
        self.n_passes_over() == self.n_passes()
    }

    /// Passes that all tiles are through.
    pub(crate) fn n_passes_over(&self) -> u32 {
        let done = self.tiles.iter().map(|tile| tile.n_done);
        done.min().unwrap_or(self.n_passes())
    }

    /// Whether nobody holds a unit.
    pub(crate) fn is_idle(&self) -> bool {
        self.tiles.iter().all(|tile| tile.leases.is_empty())
    }

    /// What became of units so far.
    pub(crate) fn counts(&self) -> UnitCounts {
        let sum =
            |count: fn(&TileRecord) -> usize| self.tiles.iter().map(count).sum::<usize>() as u64;
        let n_done = sum(|tile| tile.accepted.len());
        let to_do = |tile: &TileRecord| {
            let cuts = self.plan.cuts.iter();
            cuts.filter(|&&cut| cut > tile.n_done).count() as u64
        };
        UnitCounts {
            n_units: n_done + self.tiles.iter().map(to_do).sum::<u64>(),
            n_done,
            n_held: sum(|tile| tile.leases.len()),
            n_lent: self.next_lease - 1,
            n_lent_again: self.n_lent_again,
            n_late_results: self.n_late_results,
        }
    }

    /// Lends a unit; none where there is nothing to do now. Earlier passes come first, then tiles
    /// whose sums the worker has, then the middle of the picture. Where all is lent, units that are
    /// late are lent once more.
    pub(crate) fn lend(&mut self, holder: Holder, now: Duration) -> Option<Grant> {
        let tile_idx = self
            .free_tile(holder)
            .or_else(|| self.late_tile(holder, now))?;
        let id = self.next_lease;
        self.next_lease += 1;
        let record = &mut self.tiles[tile_idx];
        let start = record.n_done;
        let end = *self.plan.cuts.iter().find(|&&cut| cut > start)?;
        self.n_lent_again += u64::from(record.n_lent >= end);
        record.n_lent = end;
        record.leases.push(LeaseRecord {
            id,
            holder,
            passes: start..end,
            deadline: now + self.patience,
        });
        Some(Grant {
            id,
            unit: Unit {
                tile: tile_idx as u32,
                passes: start..end,
            },
            start: match (start, record.kept_by) {
                (0, _) => LeaseStart::Empty,
                (_, Some(epoch)) if epoch == holder.epoch => LeaseStart::Kept,
                _ => LeaseStart::Sums,
            },
        })
    }

    /// Takes a result.
    pub(crate) fn settle(
        &mut self,
        holder: Holder,
        lease: u64,
        unit: &Unit,
        digest: Digest,
    ) -> Verdict {
        let Some(record) = self.tiles.get_mut(unit.tile as usize) else {
            return Verdict::Unknown;
        };
        if record.take_lease(holder, lease, unit).is_none() {
            return Verdict::Unknown;
        }
        if record.n_done == unit.passes.start {
            record.accept(unit.passes.clone(), digest, Some(holder.rank));
            record.kept_by = Some(holder.epoch);
            return Verdict::First;
        }
        self.n_late_results += 1;
        let mut accepted = record.accepted.iter();
        match accepted.find(|accepted| accepted.passes == unit.passes) {
            Some(first) if first.digest != digest && self.plan.is_repeatable => {
                Verdict::Differs { from: first.from }
            }
            _ => Verdict::Equal,
        }
    }

    /// Takes a unit back that came to nothing; whether it was lent.
    pub(crate) fn release(&mut self, holder: Holder, lease: u64, unit: &Unit) -> bool {
        let record = self.tiles.get_mut(unit.tile as usize);
        let lease = record.and_then(|record| record.take_lease(holder, lease, unit));
        lease.is_some()
    }

    /// Takes a result that was kept from an earlier run; whether it follows on what is there.
    pub(crate) fn restore(&mut self, unit: &Unit, digest: Digest) -> bool {
        match self.tiles.get_mut(unit.tile as usize) {
            Some(record) if record.n_done == unit.passes.start => {
                record.accept(unit.passes.clone(), digest, None);
                true
            }
            _ => false,
        }
    }

    /// Takes back all that a life held which has ended.
    pub(crate) fn bury(&mut self, epoch: u32) {
        for record in &mut self.tiles {
            record.leases.retain(|l| l.holder.epoch != epoch);
            if record.kept_by == Some(epoch) {
                record.kept_by = None;
            }
        }
    }

    /// Passes of the frame.
    pub(crate) fn n_passes(&self) -> u32 {
        self.plan.cuts.last().copied().unwrap_or(0)
    }

    /// Passes that a tile may be through and still be lent.
    fn open_passes(&self) -> Range<u32> {
        let first = self.n_passes_over();
        let last = if self.plan.in_step {
            first + 1
        } else {
            self.n_passes()
        };
        first..last.min(self.n_passes())
    }

    fn free_tile(&self, holder: Holder) -> Option<usize> {
        let open = self.open_passes();
        let free = self
            .tiles
            .iter()
            .enumerate()
            .filter(|(_, tile)| open.contains(&tile.n_done) && tile.leases.is_empty());
        let rank = |&(idx, tile): &(usize, &TileRecord)| {
            let is_elsewhere = tile.n_done > 0 && tile.kept_by != Some(holder.epoch);
            (tile.n_done, is_elsewhere, idx)
        };
        free.min_by_key(rank).map(|(idx, _)| idx)
    }

    fn late_tile(&self, holder: Holder, now: Duration) -> Option<usize> {
        let open = self.open_passes();
        let late = |tile: &TileRecord| {
            let is_late = |l: &LeaseRecord| l.deadline <= now && l.holder.epoch != holder.epoch;
            open.contains(&tile.n_done) && tile.leases.iter().all(is_late)
        };
        self.tiles.iter().position(late)
    }
}

impl TileRecord {
    /// Ends a lease, if there is such a one.
    fn take_lease(&mut self, holder: Holder, lease: u64, unit: &Unit) -> Option<LeaseRecord> {
        let is_this =
            |l: &LeaseRecord| l.id == lease && l.holder == holder && l.passes == unit.passes;
        let at = self.leases.iter().position(is_this)?;
        Some(self.leases.remove(at))
    }

    fn accept(&mut self, passes: Range<u32>, digest: Digest, from: Option<u32>) {
        self.n_done = passes.end;
        self.accepted.push(Accepted {
            passes,
            digest,
            from,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    const A: Holder = Holder { rank: 0, epoch: 1 };
    const B: Holder = Holder { rank: 1, epoch: 2 };
    const PATIENCE: Duration = Duration::from_secs(10);
    const START: Duration = Duration::ZERO;

    fn ledger(n_tiles: u32, cuts: &[u32], in_step: bool) -> Ledger {
        let plan = Plan {
            n_tiles,
            cuts: cuts.to_vec(),
            in_step,
            is_repeatable: true,
        };
        Ledger::new(plan, PATIENCE)
    }

    /// A result that follows from the unit, as results do.
    fn digest(unit: &Unit) -> Digest {
        *blake3::hash(format!("{unit:?}").as_bytes()).as_bytes()
    }

    #[test]
    fn each_unit_is_lent_once_while_nobody_is_late() {
        let mut ledger = ledger(5, &[3], false);
        let grants: Vec<Grant> = std::iter::from_fn(|| ledger.lend(A, START)).collect();
        let tiles: Vec<u32> = grants.iter().map(|g| g.unit.tile).collect();
        assert_eq!(tiles, [0, 1, 2, 3, 4]);
        assert_eq!(ledger.lend(B, PATIENCE / 2), None);
        for grant in &grants {
            assert_eq!(grant.start, LeaseStart::Empty);
            let verdict = ledger.settle(A, grant.id, &grant.unit, digest(&grant.unit));
            assert_eq!(verdict, Verdict::First);
        }
        assert!(ledger.is_complete() && ledger.is_idle());
        assert_eq!(ledger.lend(A, PATIENCE), None);
        let counts = ledger.counts();
        assert_eq!((counts.n_units, counts.n_done, counts.n_held), (5, 5, 0));
        assert_eq!((counts.n_lent, counts.n_lent_again), (5, 0));
    }

    #[test]
    fn late_units_are_lent_again_and_the_first_result_counts() {
        let mut ledger = ledger(1, &[2], false);
        let first = ledger.lend(A, START).unwrap();
        assert_eq!(ledger.lend(A, PATIENCE), None, "not to the one who is late");
        let second = ledger.lend(B, PATIENCE).unwrap();
        assert_eq!(first.unit, second.unit);
        let unit = &first.unit;
        assert_eq!(
            ledger.settle(B, second.id, unit, digest(unit)),
            Verdict::First
        );
        assert!(ledger.is_complete());
        assert_eq!(
            ledger.settle(A, first.id, unit, digest(unit)),
            Verdict::Equal
        );
        let again = ledger.settle(A, first.id, unit, digest(unit));
        assert_eq!(again, Verdict::Unknown, "a lease ends with its result");
        let counts = ledger.counts();
        assert_eq!((counts.n_units, counts.n_done), (1, 1));
        assert_eq!((counts.n_lent, counts.n_lent_again), (2, 1));
        assert_eq!(counts.n_late_results, 1);
    }

    #[test]
    fn results_that_differ_are_an_alarm() {
        let mut ledger = ledger(1, &[2], false);
        let first = ledger.lend(A, START).unwrap();
        let second = ledger.lend(B, PATIENCE).unwrap();
        ledger.settle(A, first.id, &first.unit, digest(&first.unit));
        let verdict = ledger.settle(B, second.id, &second.unit, [7; 32]);
        assert_eq!(verdict, Verdict::Differs { from: Some(A.rank) });
    }

    #[test]
    fn what_the_dead_held_is_lent_again_and_their_results_do_not_count() {
        let mut ledger = ledger(2, &[1, 2], false);
        let lost = ledger.lend(A, START).unwrap();
        ledger.bury(A.epoch);
        let verdict = ledger.settle(A, lost.id, &lost.unit, digest(&lost.unit));
        assert_eq!(verdict, Verdict::Unknown);
        let again = ledger.lend(B, START).unwrap();
        assert_eq!(again.unit, lost.unit);
        let verdict = ledger.settle(A, again.id, &again.unit, digest(&again.unit));
        assert_eq!(verdict, Verdict::Unknown, "a lease of someone else");
    }

    #[test]
    fn sums_are_sent_to_those_who_have_not_made_them() {
        let mut ledger = ledger(2, &[1, 2], false);
        for holder in [A, B] {
            let grant = ledger.lend(holder, START).unwrap();
            ledger.settle(holder, grant.id, &grant.unit, digest(&grant.unit));
        }
        let (b, a) = (
            ledger.lend(B, START).unwrap(),
            ledger.lend(A, START).unwrap(),
        );
        assert_eq!((a.unit.tile, a.start), (0, LeaseStart::Kept));
        assert_eq!((b.unit.tile, b.start), (1, LeaseStart::Kept));
        ledger.bury(A.epoch);
        let stolen = ledger.lend(B, START).unwrap();
        assert_eq!((stolen.unit.tile, stolen.start), (0, LeaseStart::Sums));
    }

    #[test]
    fn in_step_no_tile_begins_a_pass_before_all_are_through_the_last() {
        let mut ledger = ledger(2, &[1, 2], true);
        let first = ledger.lend(A, START).unwrap();
        let second = ledger.lend(B, START).unwrap();
        ledger.settle(A, first.id, &first.unit, digest(&first.unit));
        assert_eq!(ledger.lend(A, START), None);
        assert_eq!(ledger.n_passes_over(), 0);
        ledger.settle(B, second.id, &second.unit, digest(&second.unit));
        assert_eq!(ledger.n_passes_over(), 1);
        assert_eq!(ledger.lend(A, START).unwrap().unit.passes, 1..2);
    }

    #[test]
    fn what_was_kept_is_not_lent_and_units_go_on_from_it() {
        let mut ledger = ledger(2, &[4], false);
        let kept = Unit {
            tile: 0,
            passes: 0..3,
        };
        assert!(ledger.restore(&kept, digest(&kept)));
        assert!(
            !ledger.restore(&kept, digest(&kept)),
            "it does not follow on itself"
        );
        let units: Vec<Unit> = std::iter::from_fn(|| ledger.lend(A, START))
            .map(|grant| grant.unit)
            .collect();
        assert_eq!((units[0].tile, units[1].passes.clone()), (1, 3..4));
    }

    /// Workers that die, are late, answer twice and in any order: every unit counts once.
    #[test]
    fn whatever_happens_each_unit_counts_once() {
        for seed in 0..200_u32 {
            let mut state = seed;
            let mut random = |n: u32| {
                state = kilauea_math::hash::mix32(state.wrapping_add(0x9e37_79b9));
                state % n
            };
            let mut ledger = ledger(4, &[1, 3, 4], seed % 2 == 0);
            let mut lives = [1, 2, 3];
            let mut next_life = 4;
            let mut held: Vec<(Holder, Grant)> = Vec::new();
            let mut counted = HashSet::new();
            let mut now = Duration::ZERO;
            for _ in 0..10_000 {
                now += Duration::from_secs(random(6).into());
                let rank = random(3);
                let holder = Holder {
                    rank,
                    epoch: lives[rank as usize],
                };
                match random(8) {
                    0 => {
                        ledger.bury(holder.epoch);
                        lives[rank as usize] = next_life;
                        next_life += 1;
                    }
                    1..=3 => held.extend(ledger.lend(holder, now).map(|grant| (holder, grant))),
                    _ if held.is_empty() => {}
                    _ => {
                        let at = random(held.len() as u32) as usize;
                        let (holder, grant) = &held[at];
                        let verdict =
                            ledger.settle(*holder, grant.id, &grant.unit, digest(&grant.unit));
                        let key = (grant.unit.tile, grant.unit.passes.start);
                        match verdict {
                            Verdict::First => assert!(counted.insert(key), "seed {seed}"),
                            Verdict::Equal => assert!(counted.contains(&key), "seed {seed}"),
                            Verdict::Unknown => {}
                            Verdict::Differs { .. } => panic!("seed {seed}: {grant:?}"),
                        }
                    }
                }
                if ledger.is_complete() {
                    break;
                }
            }
            assert!(ledger.is_complete(), "seed {seed}");
            assert_eq!(counted.len(), 12, "seed {seed}");
        }
    }
}
