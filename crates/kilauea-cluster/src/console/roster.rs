//! Who works: starts workers, finds out who is dead, and replaces them.

use std::sync::Arc;
use std::time::Duration;

use kilauea_render::peak_rss_bytes;

use super::Console;
use super::launch::{Launched, WorkerProcess, launch};
use super::peer::{Peer, Stage};
use crate::crew::Fit;
use crate::error::ClusterError;
use crate::ledger::Holder;
use crate::link::Link;
use crate::options::WorkerKind;
use crate::protocol::{Heartbeat, Message};
use crate::stats::WorkerStats;
use crate::ticket::Ticket;
use crate::tls::Authority;
use crate::worker::HEARTBEAT;

impl Console {
    /// Starts a worker that was started `incarnation` times before.
    pub(super) fn start_worker(&mut self, rank: u32, incarnation: u32) -> Result<(), ClusterError> {
        self.n_started += 1;
        let epoch = self.n_started;
        let ticket = Ticket {
            address: self.address.clone(),
            session: self.gate.session,
            token: self.gate.token.clone(),
            rank,
            incarnation,
            epoch,
            identity: self.authority.as_ref().map(Authority::worker).transpose()?,
        };
        self.gate.expected.add(epoch, rank, incarnation);
        let mut stats = WorkerStats {
            rank,
            incarnation,
            seat: self.sets.as_ref().map(|sets| sets.seat(rank)),
            ..WorkerStats::default()
        };
        let idle = self.take_idle();
        let process = match launch(&self.options.kind, &ticket, idle)? {
            Launched::Process(process) => {
                stats.pid = process.pid();
                Some(process)
            }
            Launched::Thread(end) => {
                let traffic = Arc::clone(&self.gate.traffic);
                let link = Link::over_channel(end, self.gate.session, traffic);
                let gate = self.gate.clone();
                tokio::spawn(async move { gate.receive(link).await });
                None
            }
            Launched::Elsewhere => {
                self.tickets.push(ticket);
                None
            }
        };
        let peer = Peer {
            holder: Holder { rank, epoch },
            stage: Stage::Starting,
            last_heard: self.now(),
            ready_at: Duration::ZERO,
            address: None,
            n_leases: 0,
            n_passes_over: 0,
            stats,
            process,
        };
        self.peers.insert(epoch, peer);
        Ok(())
    }

    /// A worker of an earlier frame, if there is one that fits.
    fn take_idle(&self) -> Option<WorkerProcess> {
        self.options.crew.as_ref()?.take(&self.fit()?)
    }

    /// Lets those who have reported go, into the crew if there is one.
    pub(super) fn dismiss(&mut self) {
        let (Some(crew), Some(fit)) = (&self.options.crew, self.fit()) else {
            return;
        };
        let finished = self.peers.values_mut();
        let finished = finished.filter(|peer| matches!(peer.stage, Stage::Finished));
        let processes = finished.filter_map(|peer| peer.process.take());
        crew.keep(processes, &fit);
    }

    /// What an idle worker must be like; none where workers are no processes of ours.
    fn fit(&self) -> Option<Fit> {
        let WorkerKind::Processes { program, arguments } = &self.options.kind else {
            return None;
        };
        let start = &self.gate.payload.start;
        Some(Fit {
            program: program.clone(),
            arguments: arguments.clone(),
            specialize_rays: start.specialize_rays,
            texture_memory_bytes: start.settings.texture_memory_bytes,
        })
    }

    /// Says that the console is alive and finds out who is not.
    pub(super) fn tick(&mut self) -> Result<(), ClusterError> {
        let now = self.now();
        let slept = now
            .saturating_sub(self.last_tick)
            .saturating_sub(2 * HEARTBEAT);
        self.last_tick = now;
        let mut lost = Vec::new();
        let peak_rss = peak_rss_bytes();
        for (&epoch, peer) in &mut self.peers {
            // A console that slept itself has heard nobody, and judges nobody for that.
            peer.last_heard += slept;
            let frame = Heartbeat { peak_rss }.frame(epoch, &[]);
            let is_stuck =
                !matches!(peer.stage, Stage::Starting | Stage::Finished) && !peer.send(frame);
            let stuck = || is_stuck.then(|| "it takes no more frames".to_owned());
            lost.extend(
                peer.why_lost(now, self.options.dead_after)
                    .or_else(stuck)
                    .map(|reason| (epoch, reason)),
            );
        }
        for (epoch, reason) in lost {
            self.replace(epoch, &reason)?;
        }
        match &mut self.journal {
            Some(journal) => Ok(journal.sync_now_and_then()?),
            None => Ok(()),
        }
    }

    /// Takes back what a worker held and starts it again, if that may be done.
    pub(super) fn replace(&mut self, epoch: u32, reason: &str) -> Result<(), ClusterError> {
        let Some(peer) = self.peers.get(&epoch) else {
            return Ok(());
        };
        // One that has reported is free to go.
        if matches!(peer.stage, Stage::Finished) {
            return Ok(());
        }
        let (rank, incarnation) = (peer.holder.rank, peer.stats.incarnation);
        self.bury(epoch, reason);
        self.tell_set_of(rank);
        let n_restarts = self.n_started.saturating_sub(self.options.n_workers);
        let is_needed = !self.ledger.is_complete() && !self.is_late();
        if n_restarts < self.options.max_restarts && is_needed {
            return self.start_worker(rank, incarnation + 1);
        }
        if is_needed {
            self.disband_set_of(rank);
        }
        if self.peers.is_empty() && is_needed {
            return Err(ClusterError::NoWorkers {
                n_started: self.n_started,
                reason: reason.to_owned(),
                is_kept: self.journal.is_some(),
            });
        }
        Ok(())
    }

    /// Takes back what a worker held, which is lost.
    pub(super) fn bury(&mut self, epoch: u32, reason: &str) {
        if self
            .peers
            .get(&epoch)
            .is_some_and(|peer| matches!(peer.stage, Stage::Finished))
        {
            return;
        }
        if let Some(mut peer) = self.peers.remove(&epoch) {
            self.ledger.bury(epoch);
            self.paths.bury(epoch);
            self.gate.expected.remove(epoch);
            peer.stats.lost = Some(reason.to_owned());
            self.lost.push(peer.stats);
        }
    }
}
