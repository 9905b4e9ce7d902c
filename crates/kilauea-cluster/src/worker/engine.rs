//! The engine of a worker: prepares what there is of the scene and renders the units that are lent.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread;
use std::time::Instant;

use kilauea_render::{Conditions, MemberSeat, PrepareOptions, PreparedScene, RenderJob};
use kilauea_scene::{Camera, RenderSettings};
use tokio::sync::mpsc;

use super::held::Held;
use super::leases::Leases;
use super::set::{Answerers, Part, SetLinks};
use crate::link::Traffic;
use crate::protocol::{Failed, Frame, Message, Ready, Report, Seat, Start};
use crate::stats::NetworkStats;

/// Lines of warnings in a report.
const MAX_WARNINGS: usize = 1000;

/// What a worker renders from.
pub(super) enum Work {
    /// A whole scene.
    Whole(Box<Whole>),
    /// A part of one.
    Part(Box<(Part, Membership)>),
}

/// A whole scene that is sent, or one that is held.
pub(super) struct Whole {
    pub(super) bytes: Option<Vec<u8>>,
    pub(super) held: Option<Held>,
    pub(super) camera: Camera,
}

/// What a member of a set has to do with the others.
pub(super) struct Membership {
    pub(super) seat: Seat,
    pub(super) links: Arc<SetLinks>,
    pub(super) traffic: Arc<Traffic>,
    pub(super) address: String,
    pub(super) answerers: Answerers,
}

/// A scene that is ready, and what is to be said of it.
struct Prepared {
    scene: Arc<PreparedScene>,
    conditions: Conditions,
    /// Where other members of the set are answered.
    address: Option<String>,
    /// Links to them.
    traffic: Arc<Traffic>,
    /// Kept for the next frame.
    held: Option<Held>,
}

impl Whole {
    fn prepare(self, scene_hash: [u8; 32], options: PrepareOptions) -> Result<Prepared, String> {
        let mut held = match (self.bytes, self.held) {
            (Some(bytes), held) => {
                drop(held);
                Held::prepare(bytes, scene_hash, options)
            }
            (None, Some(held)) => held.again(options),
            (None, None) => Err("a worker was sent no scene and has none".into()),
        }?;
        held.set_camera(self.camera)?;
        Ok(Prepared {
            scene: Arc::clone(&held.prepared),
            conditions: Conditions::default(),
            address: None,
            traffic: Arc::default(),
            held: Some(held),
        })
    }
}

/// What renders, on threads of its own.
pub(super) struct Engine {
    pub(super) leases: Arc<Leases>,
    pub(super) outbox: mpsc::Sender<Frame>,
    pub(super) epoch: u32,
    /// When the scene was here: time limits count from then on.
    pub(super) begun: Instant,
}

impl Engine {
    pub(super) fn render(self, start: &Start, work: Work) -> Option<Held> {
        let rendered = catch_unwind(AssertUnwindSafe(|| self.render_units(start, work)));
        let (said, held) = match rendered {
            Ok(Ok((report, held))) => (report.frame(self.epoch, &[]), held),
            Ok(Err(reason)) => (Failed { reason }.frame(self.epoch, &[]), None),
            Err(_) => {
                let reason = "internal error: a worker panicked; its message is on stderr".into();
                (Failed { reason }.frame(self.epoch, &[]), None)
            }
        };
        // Where nobody takes it any more, nobody waits for it.
        let _ = self.outbox.blocking_send(said);
        held
    }

    fn render_units(&self, start: &Start, work: Work) -> Result<(Report, Option<Held>), String> {
        let mut settings = start.settings.clone();
        if settings.threads == 0 {
            settings.threads = thread::available_parallelism().map_or(1, usize::from) as u32;
        }
        let options = PrepareOptions {
            texture_memory_bytes: settings.texture_memory_bytes,
            specialize_rays: start.specialize_rays,
        };
        let Prepared {
            scene,
            conditions,
            address,
            traffic,
            held,
        } = match work {
            Work::Whole(whole) => whole.prepare(start.scene_hash, options),
            Work::Part(part) => self.prepare_part(*part, &settings, &options),
        }?;
        let n_threads = settings.threads;
        let preparing_secs = self.begun.elapsed().as_secs_f64();
        let limit = &mut settings.time_limit_secs;
        *limit = limit.map(|secs| (secs - preparing_secs).max(0.0));
        let ready = Ready { n_threads, address }.frame(self.epoch, &[]);
        self.outbox
            .blocking_send(ready)
            .map_err(|error| error.to_string())?;
        let source = Arc::clone(&self.leases);
        let job = RenderJob::start_units(conditions, scene, settings, source)
            .map_err(|error| error.to_string())?;
        let result = job.finish().map_err(|error| error.to_string())?;
        let mut stats = result.stats;
        stats.warnings.truncate(MAX_WARNINGS);
        let links = NetworkStats::from(&*traffic);
        Ok((Report { stats, links }, held))
    }

    /// Prepares a part of a scene, and begins to answer from it.
    fn prepare_part(
        &self,
        (part, membership): (Part, Membership),
        settings: &RenderSettings,
        options: &PrepareOptions,
    ) -> Result<Prepared, String> {
        let Membership {
            seat,
            links,
            traffic,
            address,
            answerers,
        } = membership;
        let member_seat = MemberSeat {
            outline: part.outline,
            number: seat.number as usize,
            partners: links,
            packing: seat.packing,
            photon_bytes: seat.photon_bytes,
        };
        let scene = PreparedScene::member(part.scene, member_seat, options);
        let scene = Arc::new(scene.map_err(|error| error.to_string())?);
        let n_threads = settings.threads as usize;
        answerers
            .start(&scene, seat.packing, n_threads, &self.outbox, self.epoch)
            .map_err(|error| format!("a worker cannot start threads: {error}"))?;
        let conditions = Conditions {
            broadcast: seat.broadcast,
            ..Conditions::default()
        };
        Ok(Prepared {
            scene,
            conditions,
            address: Some(address),
            traffic,
            held: None,
        })
    }
}
