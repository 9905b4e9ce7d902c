//! What workers say, and what comes of it.

use std::sync::atomic::Ordering;
use std::time::Duration;

use kilauea_render::TileResult;
use tokio::sync::mpsc;

use super::Console;
use super::gate::Event;
use super::peer::{Peer, Stage};
use super::results::digest;
use crate::error::ClusterError;
use crate::ledger::Verdict;
use crate::protocol::{
    Failed, Frame, FrameError, FrameKind, Heartbeat, Hello, Message, PathsLeft, PathsWanted, Ready,
    Report, UnitDone, UnitDropped, UnitRefused,
};

/// What a frame of a worker says.
enum Said<'a> {
    Alive(Heartbeat),
    Ready(Ready),
    Done(UnitDone, &'a [u8]),
    Refused(UnitRefused),
    Dropped(UnitDropped),
    WantsPaths(PathsWanted),
    PathsLeft(PathsLeft),
    Report(Box<Report>),
    Failed(Failed),
}

impl<'a> Said<'a> {
    fn read(frame: &'a Frame) -> Result<Self, FrameError> {
        match frame.kind {
            FrameKind::Heartbeat => Ok(Self::Alive(Heartbeat::read(frame)?.0)),
            FrameKind::Ready => Ok(Self::Ready(Ready::read(frame)?.0)),
            FrameKind::UnitDone => UnitDone::read(frame).map(|(done, sums)| Self::Done(done, sums)),
            FrameKind::UnitRefused => Ok(Self::Refused(UnitRefused::read(frame)?.0)),
            FrameKind::UnitDropped => Ok(Self::Dropped(UnitDropped::read(frame)?.0)),
            FrameKind::PathsWanted => Ok(Self::WantsPaths(PathsWanted::read(frame)?.0)),
            FrameKind::PathsLeft => Ok(Self::PathsLeft(PathsLeft::read(frame)?.0)),
            FrameKind::Report => Ok(Self::Report(Box::new(Report::read(frame)?.0))),
            FrameKind::Failed => Ok(Self::Failed(Failed::read(frame)?.0)),
            found => Err(FrameError::Unexpected {
                found,
                expected: "something that workers say",
            }),
        }
    }
}

impl Console {
    /// Does what an event calls for. An error ends the frame.
    pub(super) fn handle(&mut self, event: Event) -> Result<(), ClusterError> {
        let now = self.now();
        match event {
            Event::Joined { hello, outbox } => self.welcome(&hello, outbox),
            Event::Gone { epoch, error } => self.replace(epoch, &error.to_string())?,
            Event::Said { epoch, frame } => {
                // What the dead say is not heard.
                let Some(peer) = self.peers.get_mut(&epoch).filter(|_| frame.epoch == epoch) else {
                    let stale = &self.gate.traffic.stale_messages;
                    stale.fetch_add(1, Ordering::Relaxed);
                    return Ok(());
                };
                peer.last_heard = now;
                match Said::read(&frame) {
                    Ok(said) => self.hear(epoch, said, &frame)?,
                    Err(error) => self.replace(epoch, &error.to_string())?,
                }
            }
        }
        Ok(())
    }

    fn welcome(&mut self, hello: &Hello, outbox: mpsc::Sender<Frame>) {
        let now = self.now();
        if let Some(peer) = self.peers.get_mut(&hello.epoch) {
            peer.stage = Stage::Preparing(outbox);
            peer.stats.kept_scene = self.gate.payload.is_kept_by(hello);
            peer.last_heard = now;
        }
    }

    fn hear(&mut self, epoch: u32, said: Said<'_>, frame: &Frame) -> Result<(), ClusterError> {
        let now = self.now();
        let Some(peer) = self.peers.get_mut(&epoch) else {
            return Ok(());
        };
        match said {
            Said::Alive(beat) => peer.stats.peak_rss = beat.peak_rss,
            Said::Ready(ready) => {
                let rank = peer.holder.rank;
                peer.begin(ready, now);
                self.tell_set_of(rank);
            }
            Said::Done(done, sums) => self.take_result(epoch, frame, done, sums)?,
            Said::Refused(refused) => self.replace(epoch, &refused.reason)?,
            Said::Dropped(UnitDropped { lease, unit }) => {
                peer.n_leases = peer.n_leases.saturating_sub(1);
                let was_lent = self.ledger.release(peer.holder, lease, &unit);
                peer.stats.units_dropped += u64::from(was_lent);
            }
            Said::WantsPaths(wanted) => self.want_paths(epoch, wanted.pass)?,
            Said::PathsLeft(left) => self.take_paths(epoch, &left, frame)?,
            Said::Report(report) => {
                peer.stage = Stage::Finished;
                if let Some(seat) = &mut peer.stats.seat {
                    seat.links = report.links;
                }
                self.reports.push((peer.holder, report.stats));
            }
            Said::Failed(failed) => return Err(ClusterError::Failed(failed.reason)),
        }
        Ok(())
    }

    fn take_result(
        &mut self,
        epoch: u32,
        frame: &Frame,
        done: UnitDone,
        sums: &[u8],
    ) -> Result<(), ClusterError> {
        let now = self.now();
        let Some(peer) = self.peers.get_mut(&epoch) else {
            return Ok(());
        };
        let holder = peer.holder;
        peer.n_leases = peer.n_leases.saturating_sub(1);
        let UnitDone { lease, unit, tally } = done;
        let result = TileResult {
            sums: sums.to_vec(),
            unit,
            tally,
        };
        match self
            .ledger
            .settle(holder, lease, &result.unit, digest(&result))
        {
            Verdict::First => {
                peer.stats.units += 1;
                peer.stats.rays += result.tally.n_rays();
                peer.stats.working_secs = now.saturating_sub(peer.ready_at).as_secs_f64();
                if let Err(error) = self.frame.put(result) {
                    return Err(ClusterError::Failed(format!(
                        "worker {}: {error}",
                        holder.rank
                    )));
                }
                if let Some(journal) = &mut self.journal {
                    journal.add(frame)?;
                }
            }
            Verdict::Differs { from } => {
                let from = from.map_or("the journal".into(), |rank| format!("worker {rank}"));
                let unit = &result.unit;
                self.alarms.push(format!(
                    "worker {} and {from} computed different results for tile {}, passes {:?}: \
                     one of them computes wrongly",
                    holder.rank, unit.tile, unit.passes
                ));
            }
            Verdict::Equal | Verdict::Unknown => {}
        }
        Ok(())
    }
}

impl Peer {
    /// It has prepared the scene.
    fn begin(&mut self, ready: Ready, now: Duration) {
        self.stats.threads = ready.n_threads;
        self.ready_at = now;
        self.address = ready.address;
        if let Stage::Preparing(outbox) = &self.stage {
            self.stage = Stage::Working(outbox.clone());
        }
    }
}
