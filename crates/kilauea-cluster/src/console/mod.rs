//! The console: lends units to workers, takes their results, and replaces those that die.

mod gate;
mod hear;
mod launch;
mod paths;
mod payload;
mod peer;
mod results;
mod roster;
mod set;
#[cfg(test)]
mod tests;
mod watch;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use kilauea_render::{CollectedFrame, RenderResult, RenderStats};
use kilauea_scene::{RenderSettings, Scene, Shading};
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::time::interval;

use crate::error::ClusterError;
use crate::handshake::build_hash;
use crate::job::Status;
use crate::journal::Journal;
use crate::ledger::{Grant, Holder, Ledger};
use crate::link::Traffic;
use crate::options::{ClusterOptions, WorkerKind};
use crate::plan::Plan;
use crate::protocol::{Finish, Frame, Lease, LeaseStart, Manifest, Message, PassesOver, Start};
use crate::scene::{SceneChunks, camera_to_bytes};
use crate::snapshot::UnitCounts;
use crate::stats::{NetworkStats, WorkerStats};
use crate::ticket::{Ticket, Token, random_u64};
use crate::tls::Authority;
use crate::worker::HEARTBEAT;
use gate::{Event, Expected, Gate};
pub(crate) use launch::WorkerProcess;
use paths::SharedPasses;
use payload::{Payload, SceneForWorkers};
use peer::{Peer, Stage};
pub(crate) use results::restore;
use results::settings_hash;
use set::{Parts, Sets, merge_members};

/// Events that wait to be handled.
const MAX_EVENTS: usize = 256;
/// Threads of a worker on another machine, as far as it matters how finely work is cut.
const THREADS_ELSEWHERE: u32 = 16;
/// Time after a time limit for units that are being rendered.
const LIMIT_GRACE: Duration = Duration::from_secs(1);
/// Time for workers to say how it went.
const REPORT_TIME: Duration = Duration::from_secs(2);
/// The same after a time limit.
const LATE_REPORT_TIME: Duration = Duration::from_millis(500);

/// A frame that workers have rendered.
pub struct ClusterResult {
    /// Pixels and statistics, as of one process.
    pub frame: RenderResult,
    /// Workers in the order of their starts.
    pub workers: Vec<WorkerStats>,
    /// What went over links.
    pub network: NetworkStats,
    /// What became of units.
    pub units: UnitCounts,
    /// Where the results of a whole frame are kept: to be removed once nobody needs them.
    pub journal: Option<Journal>,
}

/// A console with its workers.
pub(crate) struct Console {
    options: ClusterOptions,
    frame: CollectedFrame,
    ledger: Ledger,
    paths: SharedPasses,
    journal: Option<Journal>,
    gate: Gate,
    /// None where each worker has the whole scene.
    sets: Option<Sets>,
    events: mpsc::Receiver<Event>,
    address: String,
    /// Signs what workers show; none without TLS.
    authority: Option<Authority>,
    /// For those who start workers elsewhere.
    tickets: Vec<Ticket>,
    /// By epoch.
    peers: BTreeMap<u32, Peer>,
    lost: Vec<WorkerStats>,
    reports: Vec<(Holder, RenderStats)>,
    /// Workers that compute something else than others.
    alarms: Vec<String>,
    n_started: u32,
    begun: Instant,
    last_tick: Duration,
}

impl Console {
    /// A console that has started nothing.
    pub(crate) fn new(
        scene: &Scene,
        settings: &RenderSettings,
        options: ClusterOptions,
    ) -> Result<Self, ClusterError> {
        let begun = Instant::now();
        scene
            .validate()
            .map_err(kilauea_render::RenderError::from)?;
        let sets = Sets::of(scene, settings, &options)?;
        let settings = &of_workers(settings, &options, sets.is_some());
        let mut frame = CollectedFrame::new(settings)?;
        let n_threads = match settings.threads {
            0 => THREADS_ELSEWHERE,
            n => n,
        };
        let n_threads = options.n_workers.saturating_mul(n_threads);
        let plan = Plan::new(&frame, settings, n_threads);
        let mut ledger = Ledger::new(plan, options.patience);
        let camera = camera_to_bytes(&scene.camera);
        let chunks = SceneChunks::of(scene);
        let scene_hash = *blake3::hash(&chunks.bytes).as_bytes();
        let manifest = Manifest {
            build_hash: build_hash(),
            scene_hash,
            settings_hash: settings_hash(settings, &camera),
        };
        let restore = |kept: &Frame| restore(&mut frame, &mut ledger, kept);
        let journal = options.journal.as_ref();
        let journal = journal
            .map(|path| Journal::open(path, &manifest, restore))
            .transpose()?;
        let authority = options.tls.then(Authority::new).transpose()?;
        let acceptor = authority
            .as_ref()
            .map(|authority| authority.console()?.acceptor());
        let (sender, events) = mpsc::channel(MAX_EVENTS);
        let scene = match &sets {
            None => SceneForWorkers::Whole(chunks.bytes),
            Some(sets) => SceneForWorkers::Parts(Parts::of(scene, chunks, sets)?),
        };
        let common_hash = match &scene {
            SceneForWorkers::Whole(_) => scene_hash,
            SceneForWorkers::Parts(parts) => *blake3::hash(&parts.common).as_bytes(),
        };
        let start = Start {
            settings: settings.clone(),
            specialize_rays: options.specialize_rays,
            n_scene_bytes: scene.common().len() as u64,
            scene_hash: common_hash,
            seat: None,
        };
        Ok(Self {
            gate: Gate {
                token: Token::random()?,
                session: random_u64()?,
                tls: acceptor.transpose()?,
                traffic: Arc::new(Traffic::default()),
                payload: Arc::new(Payload {
                    start,
                    camera,
                    scene,
                    scene_hash,
                    begun,
                }),
                expected: Expected::default(),
                events: sender,
            },
            sets,
            options,
            frame,
            ledger,
            paths: SharedPasses::default(),
            journal,
            events,
            address: String::new(),
            authority,
            tickets: Vec::new(),
            peers: BTreeMap::new(),
            lost: Vec::new(),
            reports: Vec::new(),
            alarms: Vec::new(),
            n_started: 0,
            begun,
            last_tick: Duration::ZERO,
        })
    }

    /// Has the frame rendered.
    pub(crate) async fn run(mut self, status: &Status) -> Result<ClusterResult, ClusterError> {
        if !self.ledger.is_complete() {
            self.open().await?;
            self.lend_all(status).await?;
            self.finish().await?;
        }
        status.show(self.snapshot());
        Ok(self.into_result())
    }

    /// Starts the workers.
    async fn open(&mut self) -> Result<(), ClusterError> {
        let host = match self.options.kind {
            WorkerKind::Threads => None,
            WorkerKind::Processes { .. } => Some(IpAddr::from(Ipv4Addr::LOCALHOST)),
            WorkerKind::Elsewhere { host } => Some(host),
        };
        if let Some(host) = host {
            let listener = TcpListener::bind((host, 0)).await?;
            self.address = listener.local_addr()?.to_string();
            tokio::spawn(self.gate.clone().listen(listener));
        }
        for rank in 0..self.options.n_workers {
            self.start_worker(rank, 0)?;
        }
        Ok(())
    }

    /// Lends units until there are none, nobody waits for them, or the time is up.
    async fn lend_all(&mut self, status: &Status) -> Result<(), ClusterError> {
        let mut ticks = interval(HEARTBEAT);
        while !self.is_over(status) {
            tokio::select! {
                Some(event) = self.events.recv() => self.handle(event)?,
                _ = ticks.tick() => {
                    self.tick()?;
                    status.show(self.snapshot());
                }
                () = status.cancelled() => {}
            }
            if !self.is_late() {
                self.lend()?;
                self.lend_paths()?;
            }
            self.tell_passes_over();
            for _ in 0..status.take_added() {
                let rank = self.options.n_workers;
                self.options.n_workers += 1;
                self.start_worker(rank, 0)?;
            }
            for (epoch, reason) in status.take_ended() {
                self.replace(epoch, &reason)?;
            }
            let tickets = std::mem::take(&mut self.tickets);
            status.set(self.frame.progress(), self.pids(), tickets);
        }
        Ok(())
    }

    fn is_over(&self, status: &Status) -> bool {
        let late_by = self.now().checked_sub(self.limit());
        self.ledger.is_complete()
            || status.is_cancelled()
            || late_by.is_some_and(|by| by > LIMIT_GRACE || self.ledger.is_idle())
    }

    fn limit(&self) -> Duration {
        let limit = self.gate.payload.start.settings.time_limit_secs;
        let duration = limit.map(|secs| Duration::try_from_secs_f64(secs.max(0.0)));
        duration.and_then(Result::ok).unwrap_or(Duration::MAX)
    }

    fn is_late(&self) -> bool {
        self.now() >= self.limit()
    }

    fn now(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Tells workers that there is nothing more, and waits for what they have to say.
    async fn finish(&mut self) -> Result<(), ClusterError> {
        for peer in self.peers.values() {
            peer.send(Finish.frame(peer.holder.epoch, &[]));
        }
        let time = if self.is_late() {
            LATE_REPORT_TIME
        } else {
            REPORT_TIME
        };
        let deadline = tokio::time::Instant::now() + time;
        while self
            .peers
            .values()
            .any(|peer| matches!(peer.stage, Stage::Working(_)))
        {
            let event = tokio::time::timeout_at(deadline, self.events.recv()).await;
            let Ok(Some(event)) = event else { break };
            match event {
                Event::Gone { epoch, error } => self.bury(epoch, &error.to_string()),
                event => self.handle(event)?,
            }
        }
        Ok(())
    }

    /// Lends units to all who are free.
    fn lend(&mut self) -> Result<(), ClusterError> {
        let now = self.now();
        let mut stuck = Vec::new();
        for (&epoch, peer) in &mut self.peers {
            while peer.is_free(now, self.options.suspect_after) {
                let Some(grant) = self.ledger.lend(peer.holder, now) else {
                    break;
                };
                let Grant { id, unit, start } = grant;
                let sums = match start {
                    LeaseStart::Sums => self.frame.sums(unit.tile),
                    LeaseStart::Empty | LeaseStart::Kept => Vec::new(),
                };
                if !peer.send(Lease { id, unit, start }.frame(epoch, &sums)) {
                    stuck.push(epoch);
                    break;
                }
                peer.n_leases += 1;
            }
        }
        for epoch in stuck {
            self.replace(epoch, "it takes no more units")?;
        }
        Ok(())
    }

    fn tell_passes_over(&mut self) {
        let n_passes = self.ledger.n_passes_over();
        for (&epoch, peer) in &mut self.peers {
            if peer.n_passes_over < n_passes
                && matches!(peer.stage, Stage::Working(_))
                && peer.send(PassesOver { n_passes }.frame(epoch, &[]))
            {
                peer.n_passes_over = n_passes;
            }
        }
    }

    fn pids(&self) -> Vec<u32> {
        self.peers.values().map(|peer| peer.stats.pid).collect()
    }

    fn into_result(mut self) -> ClusterResult {
        self.dismiss();
        self.reports.sort_by_key(|(holder, _)| holder.rank);
        let render_secs = self.now().as_secs_f64();
        let mut report = fullest(&self.reports).cloned().unwrap_or_default();
        merge_members(&self.reports, self.sets.as_ref(), &mut report);
        let mut workers = self.lost;
        workers.extend(self.peers.into_values().map(|peer| peer.stats));
        workers.sort_by_key(|worker| (worker.rank, worker.incarnation));
        let peaks = workers.iter().map(|worker| worker.peak_rss);
        report.memory.peak_rss = report.memory.peak_rss.max(peaks.max().unwrap_or(0));
        report.warnings.extend(self.alarms);
        if self.ledger.is_complete() {
            // Else it may be that the time was up.
            let behind = workers.iter().filter_map(WorkerStats::why_behind);
            report.warnings.extend(behind);
        }
        report.shared_passes = self.paths.names().map(Cow::Borrowed).collect();
        let mut frame = self.frame.into_result(report);
        let times = &mut frame.stats.times;
        times.render = (render_secs - times.build - times.gather - times.photon).max(0.0);
        ClusterResult {
            journal: self.journal.filter(|_| frame.stats.is_complete),
            frame,
            workers,
            network: NetworkStats::from(&*self.gate.traffic),
            units: self.ledger.counts(),
        }
    }
}

/// The same settings with the number of threads of one worker, 0 for all cores of its machine. Members
/// of a set ask each other in batches, so that shades wait.
fn of_workers(
    settings: &RenderSettings,
    options: &ClusterOptions,
    has_sets: bool,
) -> RenderSettings {
    let n_cores = std::thread::available_parallelism().map_or(1, usize::from) as u32;
    let threads = match (settings.threads, &options.kind) {
        (0, WorkerKind::Threads | WorkerKind::Processes { .. }) => {
            (n_cores / options.n_workers.max(1)).max(1)
        }
        (n, _) => n,
    };
    RenderSettings {
        threads,
        shading: match settings.shading {
            Shading::Inline if has_sets => Shading::Queued,
            shading => shading,
        },
        ..settings.clone()
    }
}

/// The report of a worker that has been through all that comes before units, the first of them: for
/// one that came late the frame may have been over before. All have traced the same then, and rays of
/// units are in no report.
fn fullest(reports: &[(Holder, RenderStats)]) -> Option<&RenderStats> {
    let n_rays = |stats: &&RenderStats| {
        let rays = &stats.rays;
        rays.photon + rays.camera + rays.shadow + rays.indirect
    };
    let last_first = reports.iter().rev().map(|(_, stats)| stats);
    last_first.max_by_key(n_rays)
}
