//! A worker: gets a scene once, renders the units that it is lent, and ends with its console.

mod held;
mod leases;
mod set;

use std::io::{self, BufRead};
use std::net::{IpAddr, Ipv4Addr};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use kilauea_render::{
    Conditions, MemberSeat, PrepareOptions, PreparedScene, RenderJob, peak_rss_bytes,
};
use kilauea_scene::{Camera, RenderSettings};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::time::{interval, timeout};

use crate::handshake::{HANDSHAKE_TIMEOUT, HandshakeError, join_console};
use crate::link::{FrameReader, FrameWriter, Link, Traffic};
use crate::protocol::{
    Failed, Finish, Frame, FrameError, FrameKind, Heartbeat, Lease, Members, Message, PassesOver,
    Ready, Report, SceneBytes, Seat, Start,
};
use crate::scene::{SceneBytesError, camera_from_bytes};
use crate::stats::NetworkStats;
use crate::ticket::Ticket;
use held::Held;
use leases::Leases;
use set::{Answerers, Part, SetLinks, SetSide, receive_part};

/// How often both sides say that they are alive.
pub(crate) const HEARTBEAT: Duration = Duration::from_millis(250);
/// A console that says nothing for so long is gone.
const CONSOLE_TIMEOUT: Duration = Duration::from_secs(30);
/// Frames that wait to be sent; engine threads wait where there are more. The console reads whatever
/// it is busy with.
const MAX_FRAMES_WAITING: usize = 64;
/// Lines of warnings in a report.
const MAX_WARNINGS: usize = 1000;

/// Why a worker ended before its work did.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// There is no ticket on the standard input.
    #[error("standard input has no ticket: {0}")]
    Ticket(String),
    /// The console cannot be reached.
    #[error("{address}: {error}")]
    Connect {
        /// Where it should be.
        address: String,
        /// What went wrong.
        error: io::Error,
    },
    /// It and this program do not go together.
    #[error("console: {0}")]
    Handshake(#[from] HandshakeError),
    /// What it says cannot be understood, or it is gone.
    #[error("console: {0}")]
    Frame(#[from] FrameError),
    /// The scene did not come as it was sent.
    #[error("the scene is not that of the console")]
    SceneHash,
    /// The scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneBytesError),
    /// The console has said nothing for long.
    #[error("the console has said nothing for {} s", CONSOLE_TIMEOUT.as_secs())]
    Silence,
    /// The system refuses something.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// A render node. It keeps the scene of its last frame, so that the next one need not be sent it
/// again.
#[derive(Default)]
pub struct Worker {
    held: Option<Held>,
}

impl Worker {
    /// Works for the console that a ticket names, until there is nothing to do.
    pub fn work_for(&mut self, ticket: &Ticket) -> Result<(), WorkerError> {
        let held = self.held.take();
        self.held = runtime()?.block_on(async {
            let (link, host) = connect(ticket)
                .await
                .map_err(|error| WorkerError::Connect {
                    address: ticket.address.clone(),
                    error,
                })?;
            work(link, ticket, host, held).await
        })?;
        Ok(())
    }
}

/// Works for the consoles that the tickets on the standard input name, a line each, one after the
/// other until the input ends.
pub fn run_worker() -> Result<(), WorkerError> {
    let mut worker = Worker::default();
    let mut n_tickets = 0;
    for line in io::stdin().lock().lines() {
        let ticket: Ticket =
            serde_json::from_str(&line?).map_err(|error| WorkerError::Ticket(error.to_string()))?;
        worker.work_for(&ticket)?;
        n_tickets += 1;
    }
    match n_tickets {
        0 => Err(WorkerError::Ticket("it is empty".into())),
        _ => Ok(()),
    }
}

/// Works for the console that a ticket names, until there is nothing to do.
pub fn run_worker_for(ticket: &Ticket) -> Result<(), WorkerError> {
    Worker::default().work_for(ticket)
}

/// A link to the console, and the address of this machine at it.
async fn connect(ticket: &Ticket) -> io::Result<(Link, IpAddr)> {
    let stream = TcpStream::connect(&ticket.address).await?;
    let host = stream.local_addr()?.ip();
    let traffic = Arc::new(Traffic::default());
    let Some(identity) = &ticket.identity else {
        return Ok((Link::over_tcp(stream, ticket.session, traffic)?, host));
    };
    let (connector, name) = identity.connector()?;
    let stream = timeout(HANDSHAKE_TIMEOUT, connector.connect(name, stream)).await??;
    Ok((Link::over_tls(stream, ticket.session, traffic)?, host))
}

/// Where threads of one process reach each other.
pub(crate) const HERE: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

/// Works at one end of a link, with the scene that is held or the one that is sent; gives back the
/// scene that it then has. Other members of a set reach this one at `host`.
pub(crate) async fn work(
    mut link: Link,
    ticket: &Ticket,
    host: IpAddr,
    held: Option<Held>,
) -> Result<Option<Held>, WorkerError> {
    let held_hash = held.as_ref().map(Held::scene_hash);
    let scene_hash = join_console(&mut link, ticket, held_hash).await?;
    let Link { mut reader, writer } = link;
    let (outbox, frames) = mpsc::channel(MAX_FRAMES_WAITING);
    let sender = tokio::spawn(send_frames(writer, frames, ticket.epoch));
    let Order {
        start,
        camera,
        scene,
    } = receive_order(&mut reader).await?;
    let (work, set) = match &start.seat {
        None => {
            let whole = Whole {
                bytes: scene,
                held,
                camera,
            };
            (Work::Whole(Box::new(whole)), None)
        }
        Some(seat) => {
            drop(held);
            let common = scene.unwrap_or_default();
            let mut part = receive_part(&mut reader, seat, common).await?;
            part.scene.camera = camera;
            let (set, answerers) = SetSide::open(ticket, seat, scene_hash, host).await?;
            let membership = Membership {
                seat: *seat,
                links: Arc::clone(&set.links),
                traffic: set.traffic(),
                address: set.address.clone(),
                answerers,
            };
            (Work::Part(Box::new((part, membership))), Some(set))
        }
    };
    let leases = Arc::new(Leases::new(outbox.clone(), ticket.epoch));
    let engine = Engine {
        leases: Arc::clone(&leases),
        outbox,
        epoch: ticket.epoch,
        begun: Instant::now(),
    };
    let engine = thread::Builder::new()
        .name("worker".into())
        .spawn(move || engine.render(&start, work))?;
    let outcome = take_orders(&mut reader, &leases, set.as_ref()).await;
    // Ends the engine, and with it the frames that wait to be sent.
    leases.close();
    sender.abort();
    outcome?;
    // One that panicked has said so, and holds nothing.
    Ok(engine.join().unwrap_or_default())
}

/// A runtime that does nothing but wait for bytes and times.
pub(crate) fn runtime() -> io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
}

/// What is to be rendered.
struct Order {
    start: Start,
    camera: Camera,
    /// Or of what all members of a set have of it. None where this worker has it.
    scene: Option<Vec<u8>>,
}

async fn receive_order(reader: &mut FrameReader) -> Result<Order, WorkerError> {
    let frame = reader.read().await?;
    let (start, camera) = Start::read(&frame)?;
    let mut order = Order {
        camera: camera_from_bytes(camera)?,
        start,
        scene: None,
    };
    if order.start.n_scene_bytes == 0 {
        return Ok(order);
    }
    let mut scene = Vec::new();
    let mut hasher = blake3::Hasher::new();
    loop {
        let frame = reader.read().await?;
        if frame.kind == FrameKind::Heartbeat {
            continue;
        }
        let (SceneBytes, piece) = SceneBytes::read(&frame)?;
        scene.extend_from_slice(piece);
        // Piece by piece, so that heartbeats are sent meanwhile.
        hasher.update(piece);
        if scene.len() as u64 > order.start.n_scene_bytes {
            return Err(WorkerError::SceneHash);
        }
        if frame.is_last {
            let is_whole = *hasher.finalize().as_bytes() == order.start.scene_hash;
            order.scene = Some(scene);
            return is_whole.then_some(order).ok_or(WorkerError::SceneHash);
        }
    }
}

/// Takes what the console sends until it closes the link after the last unit.
async fn take_orders(
    reader: &mut FrameReader,
    leases: &Leases,
    set: Option<&SetSide>,
) -> Result<(), WorkerError> {
    let mut is_finished = false;
    loop {
        let frame = timeout(CONSOLE_TIMEOUT, reader.read()).await;
        let frame = frame.map_err(|_| WorkerError::Silence)?;
        let frame = match frame {
            Err(FrameError::Closed) if is_finished => return Ok(()),
            frame => frame?,
        };
        match frame.kind {
            FrameKind::Heartbeat => {}
            FrameKind::Lease => {
                let (lease, sums) = Lease::read(&frame)?;
                leases.add(lease, sums);
            }
            FrameKind::Members => {
                let (members, _) = Members::read(&frame)?;
                if let Some(set) = set {
                    set.set_members(members);
                }
            }
            FrameKind::PassesOver => leases.set_passes_over(PassesOver::read(&frame)?.0.n_passes),
            FrameKind::Finish => {
                let (Finish, _) = Finish::read(&frame)?;
                is_finished = true;
                leases.close();
            }
            found => {
                let expected = "an order";
                return Err(FrameError::Unexpected { found, expected }.into());
            }
        }
    }
}

/// Sends what the engine has to say, and heartbeats.
async fn send_frames(
    mut writer: FrameWriter,
    mut frames: mpsc::Receiver<Frame>,
    epoch: u32,
) -> Result<(), WorkerError> {
    let mut beats = interval(HEARTBEAT);
    loop {
        tokio::select! {
            frame = frames.recv() => match frame {
                Some(frame) => writer.write(&frame).await?,
                None => return Ok(()),
            },
            _ = beats.tick() => {
                let peak_rss = peak_rss_bytes();
                writer.write(&Heartbeat { peak_rss }.frame(epoch, &[])).await?;
            }
        }
    }
}

/// What a worker renders from.
enum Work {
    /// A whole scene.
    Whole(Box<Whole>),
    /// A part of one.
    Part(Box<(Part, Membership)>),
}

/// A whole scene that is sent, or one that is held.
struct Whole {
    bytes: Option<Vec<u8>>,
    held: Option<Held>,
    camera: Camera,
}

/// What a member of a set has to do with the others.
struct Membership {
    seat: Seat,
    links: Arc<SetLinks>,
    traffic: Arc<Traffic>,
    address: String,
    answerers: Answerers,
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
struct Engine {
    leases: Arc<Leases>,
    outbox: mpsc::Sender<Frame>,
    epoch: u32,
    /// When the scene was here: time limits count from then on.
    begun: Instant,
}

impl Engine {
    fn render(self, start: &Start, work: Work) -> Option<Held> {
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
        };
        let scene = PreparedScene::member(part.scene, member_seat, options);
        let scene = Arc::new(scene.map_err(|error| error.to_string())?);
        let n_threads = match settings.threads {
            0 => thread::available_parallelism().map_or(1, usize::from),
            n => n as usize,
        };
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
