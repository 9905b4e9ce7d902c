//! Lets other members of a set in, takes what they ask, and sends what they are answered.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::time::{sleep, timeout};
use tokio_rustls::TlsAcceptor;

use super::MAX_BATCHES_OUT;
use super::answer::Batch;
use crate::handshake::{HANDSHAKE_TIMEOUT, receive_asker};
use crate::link::{FrameReader, FrameWriter, Link, Traffic};
use crate::protocol::{Frame, FrameError, FrameKind, Hello, Members};
use crate::ticket::Ticket;

/// Connections at once, more than a set has members.
pub(super) const MAX_CONNECTIONS: usize = 128;

/// What it takes to let others in.
pub(super) struct Door {
    pub(super) ticket: Ticket,
    /// Of the whole scene.
    pub(super) scene_hash: [u8; 32],
    pub(super) tls: Option<TlsAcceptor>,
    pub(super) traffic: Arc<Traffic>,
    pub(super) members: watch::Receiver<Members>,
    pub(super) batches: mpsc::Sender<Batch>,
}

/// Lets in all who connect and are members in the life that they are in.
pub(super) async fn listen(listener: TcpListener, door: Arc<Door>) {
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        let Ok((stream, _)) = listener.accept().await else {
            // Out of descriptors, say: others may end meanwhile.
            sleep(Duration::from_millis(50)).await;
            continue;
        };
        let door = Arc::clone(&door);
        tokio::spawn(async move {
            // A link that ends is made again by who asks.
            let _ = door.receive(stream).await;
            drop(place);
        });
    }
}

impl Door {
    async fn receive(&self, stream: TcpStream) -> Result<(), FrameError> {
        let mut link = self.link_over(stream).await?;
        let mut admit = |hello: &Hello| {
            let is_member = is_in(&self.members.borrow(), hello.epoch);
            let refusal = || format!("nobody of epoch {} is in this set", hello.epoch);
            is_member.then_some(()).ok_or_else(refusal)
        };
        let received = receive_asker(&mut link, &self.ticket, self.scene_hash, &mut admit).await;
        let Ok(hello) = received else { return Ok(()) };
        let (answers, answered) = mpsc::channel(MAX_BATCHES_OUT);
        let n_open = Arc::new(AtomicUsize::new(0));
        let Link { reader, writer } = link;
        tokio::select! {
            taken = self.take_rays(reader, answers, &n_open) => taken,
            sent = send_hits(writer, answered, &n_open) => sent,
            () = has_left(self.members.clone(), hello.epoch) => Ok(()),
        }
    }

    async fn link_over(&self, stream: TcpStream) -> io::Result<Link> {
        let traffic = Arc::clone(&self.traffic);
        let Some(tls) = &self.tls else {
            return Link::over_tcp(stream, self.ticket.session, traffic);
        };
        let stream = timeout(HANDSHAKE_TIMEOUT, tls.accept(stream)).await??;
        Link::over_tls(stream, self.ticket.session, traffic)
    }

    /// Takes batches, of no more than the credit at a time.
    async fn take_rays(
        &self,
        mut reader: FrameReader,
        answers: mpsc::Sender<Frame>,
        n_open: &AtomicUsize,
    ) -> Result<(), FrameError> {
        loop {
            let frame = reader.read().await?;
            let n_before = n_open.fetch_add(1, Ordering::AcqRel);
            if frame.kind != FrameKind::Rays || n_before >= MAX_BATCHES_OUT {
                return Err(FrameError::Unexpected {
                    found: frame.kind,
                    expected: "rays, and no more than there is credit for",
                });
            }
            let batch = Batch {
                number: frame.batch,
                questions: frame.body,
                answers: answers.clone(),
            };
            if self.batches.send(batch).await.is_err() {
                return Ok(());
            }
        }
    }
}

async fn send_hits(
    mut writer: FrameWriter,
    mut answers: mpsc::Receiver<Frame>,
    n_open: &AtomicUsize,
) -> Result<(), FrameError> {
    while let Some(answer) = answers.recv().await {
        // Before it is sent: who gets it may ask at once.
        n_open.fetch_sub(1, Ordering::AcqRel);
        writer.write(&answer).await?;
    }
    Ok(())
}

/// Waits until a life is over.
async fn has_left(mut members: watch::Receiver<Members>, epoch: u32) {
    let is_over = |members: &Members| !is_in(members, epoch);
    // Where nobody tells of members any more, this worker ends.
    let _ = members.wait_for(is_over).await;
}

fn is_in(members: &Members, epoch: u32) -> bool {
    members.members.iter().any(|member| member.epoch == epoch)
}
