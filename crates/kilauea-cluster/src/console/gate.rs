//! Lets workers in: the handshake, then the scene, then frames both ways.

use std::collections::HashMap;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;

use super::payload::Payload;
use crate::handshake::{HANDSHAKE_TIMEOUT, receive_worker};
use crate::link::{FrameReader, FrameWriter, Link, Traffic};
use crate::protocol::{Frame, FrameError, Hello};
use crate::ticket::Token;

/// Connections that may be in the handshake at once; others wait.
const MAX_HANDSHAKES: usize = 32;
/// Frames that wait to be sent to a worker. It gets fewer than this while it is alive.
const MAX_FRAMES_WAITING: usize = 256;

/// What happens at links. At most a few wait to be handled: readers wait where there are more, and
/// nobody waits for readers.
pub(super) enum Event {
    /// A worker is there.
    Joined {
        hello: Hello,
        outbox: mpsc::Sender<Frame>,
    },
    /// It says something.
    Said { epoch: u32, frame: Frame },
    /// Its link is gone.
    Gone { epoch: u32, error: FrameError },
}

/// Lets workers in.
#[derive(Clone)]
pub(super) struct Gate {
    pub(super) token: Token,
    pub(super) session: u64,
    /// For connections of other machines.
    pub(super) tls: Option<TlsAcceptor>,
    pub(super) traffic: Arc<Traffic>,
    pub(super) payload: Arc<Payload>,
    pub(super) expected: Expected,
    pub(super) events: mpsc::Sender<Event>,
}

/// The lives that were started and have not joined: rank and incarnation by epoch.
#[derive(Clone, Default)]
pub(super) struct Expected(Arc<Mutex<HashMap<u32, [u32; 2]>>>);

impl Expected {
    pub(super) fn add(&self, epoch: u32, rank: u32, incarnation: u32) {
        self.lock().insert(epoch, [rank, incarnation]);
    }

    pub(super) fn remove(&self, epoch: u32) {
        self.lock().remove(&epoch);
    }

    fn admit(&self, hello: &Hello) -> Result<(), String> {
        let mut expected = self.lock();
        if expected.get(&hello.epoch) != Some(&[hello.rank, hello.incarnation]) {
            let Hello { rank, epoch, .. } = hello;
            return Err(format!(
                "worker {rank} of epoch {epoch} is not expected, or is here already"
            ));
        }
        expected.remove(&hello.epoch);
        Ok(())
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<u32, [u32; 2]>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Gate {
    /// Lets in all who connect and prove that they may.
    pub(super) async fn listen(self, listener: TcpListener) {
        let places = Arc::new(Semaphore::new(MAX_HANDSHAKES));
        while let Ok(place) = Arc::clone(&places).acquire_owned().await {
            let Ok((stream, _)) = listener.accept().await else {
                // Out of descriptors, say: others may end meanwhile.
                tokio::time::sleep(Duration::from_millis(50)).await;
                continue;
            };
            let gate = self.clone();
            tokio::spawn(async move {
                if let Ok(link) = gate.link_over(stream).await {
                    gate.receive(link).await;
                }
                drop(place);
            });
        }
    }

    async fn link_over(&self, stream: TcpStream) -> io::Result<Link> {
        let traffic = Arc::clone(&self.traffic);
        let Some(tls) = &self.tls else {
            return Link::over_tcp(stream, self.session, traffic);
        };
        let stream = timeout(HANDSHAKE_TIMEOUT, tls.accept(stream)).await??;
        Link::over_tls(stream, self.session, traffic)
    }

    /// Lets a worker in, or sends it away. One that was to come and does not is missed by the console.
    pub(super) async fn receive(&self, mut link: Link) {
        let scene_hash = self.payload.scene_hash;
        let mut admit = |hello: &Hello| self.expected.admit(hello);
        let received =
            receive_worker(&mut link, &self.token, self.session, scene_hash, &mut admit).await;
        let Ok(hello) = received else { return };
        let (rank, epoch) = (hello.rank, hello.epoch);
        let keeps_scene = self.payload.is_kept_by(&hello);
        let (outbox, frames) = mpsc::channel(MAX_FRAMES_WAITING);
        let Link { reader, writer } = link;
        let payload = Arc::clone(&self.payload);
        if self
            .events
            .send(Event::Joined { hello, outbox })
            .await
            .is_ok()
        {
            tokio::spawn(send(writer, payload, keeps_scene, frames, [rank, epoch]));
            tokio::spawn(receive_frames(reader, self.events.clone(), epoch));
        }
    }
}

/// Sends the scene to a worker that has it not, then what the console has to say. Ends where the link
/// does, which the reader sees.
async fn send(
    mut writer: FrameWriter,
    payload: Arc<Payload>,
    keeps_scene: bool,
    mut frames: mpsc::Receiver<Frame>,
    [rank, epoch]: [u32; 2],
) -> Result<(), FrameError> {
    payload
        .send(&mut writer, keeps_scene, [rank, epoch])
        .await?;
    drop(payload);
    while let Some(frame) = frames.recv().await {
        writer.write(&frame).await?;
    }
    Ok(())
}

async fn receive_frames(mut reader: FrameReader, events: mpsc::Sender<Event>, epoch: u32) {
    loop {
        let (event, is_gone) = match reader.read().await {
            Ok(frame) => (Event::Said { epoch, frame }, false),
            Err(error) => (Event::Gone { epoch, error }, true),
        };
        if events.send(event).await.is_err() || is_gone {
            return;
        }
    }
}
