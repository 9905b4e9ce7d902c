//! A worker: gets a scene once, renders the units that it is lent, and ends with its console.

mod engine;
mod held;
mod leases;
mod paths;
mod set;

use std::io::{self, BufRead};
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use kilauea_render::peak_rss_bytes;
use kilauea_scene::Camera;
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::time::{interval, timeout};

use crate::handshake::{HANDSHAKE_TIMEOUT, HandshakeError, join_console};
use crate::link::{FrameReader, FrameWriter, Link, Traffic};
use crate::protocol::{
    Finish, Frame, FrameError, FrameKind, Heartbeat, Lease, Members, Message, PassesOver,
    PathsLeft, PathsLent, SceneBytes, Start,
};
use crate::scene::{SceneBytesError, camera_from_bytes};
use crate::ticket::Ticket;
use engine::{Engine, Membership, Whole, Work};
use held::Held;
use leases::Leases;
use set::{SetSide, receive_part};

/// How often both sides say that they are alive.
pub(crate) const HEARTBEAT: Duration = Duration::from_millis(250);
/// A console that says nothing for so long is gone.
const CONSOLE_TIMEOUT: Duration = Duration::from_secs(30);
/// Frames that wait to be sent; engine threads wait where there are more. The console reads whatever
/// it is busy with.
const MAX_FRAMES_WAITING: usize = 64;

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
    let (work, set, photon_part) = match &start.seat {
        None => {
            let whole = Whole {
                bytes: scene,
                held,
                camera,
            };
            (Work::Whole(Box::new(whole)), None, None)
        }
        Some(seat) => {
            drop(held);
            let common = scene.unwrap_or_default();
            let mut part = receive_part(&mut reader, seat, common).await?;
            part.scene.camera = camera;
            let photon_part = part.outline.photon_part(seat.number as usize);
            let (set, answerers) = SetSide::open(ticket, seat, scene_hash, host).await?;
            let membership = Membership {
                seat: *seat,
                links: Arc::clone(&set.links),
                traffic: set.traffic(),
                address: set.address.clone(),
                answerers,
            };
            let work = Work::Part(Box::new((part, membership)));
            (work, Some(set), Some(photon_part))
        }
    };
    let leases = Arc::new(Leases::new(outbox.clone(), ticket.epoch, photon_part));
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
            FrameKind::PathsLent => {
                let (PathsLent { pass, paths }, _) = PathsLent::read(&frame)?;
                leases.paths().lend(pass, paths);
            }
            FrameKind::PathsLeft => {
                let (PathsLeft { pass, paths }, left) = PathsLeft::read(&frame)?;
                leases.paths().add(pass, &paths, left.to_vec());
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
