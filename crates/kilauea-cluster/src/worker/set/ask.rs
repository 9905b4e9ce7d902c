//! Keeps links to the other members of a set, over which they are asked.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::net::TcpStream;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::AbortHandle;
use tokio::time::{sleep, timeout};

use super::MAX_BATCHES_OUT;
use super::links::{Request, SetLinks};
use crate::handshake::{HANDSHAKE_TIMEOUT, HandshakeError, join_owner};
use crate::link::{FrameReader, FrameWriter, Link, Traffic};
use crate::protocol::{Frame, FrameError, FrameKind, MemberAddress, Members};
use crate::ticket::Ticket;

/// Time between attempts to reach a member: it may not have heard of us yet.
const RETRY: Duration = Duration::from_millis(20);

/// What it takes to link up with others.
pub(super) struct Asker {
    pub(super) ticket: Ticket,
    /// Of the whole scene.
    pub(super) scene_hash: [u8; 32],
    pub(super) traffic: Arc<Traffic>,
    pub(super) links: Arc<SetLinks>,
}

/// Requests without an answer, by number.
#[derive(Default)]
struct Pending(Mutex<HashMap<u16, oneshot::Sender<Vec<u8>>>>);

impl Pending {
    fn insert(&self, number: u16, reply: oneshot::Sender<Vec<u8>>) {
        self.lock().insert(number, reply);
    }

    fn remove(&self, number: u16) -> Option<oneshot::Sender<Vec<u8>>> {
        self.lock().remove(&number)
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<u16, oneshot::Sender<Vec<u8>>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Has a link to each other member that is ready, in the life that it is in.
pub(super) async fn keep_links(
    asker: Arc<Asker>,
    own_number: u32,
    mut members: watch::Receiver<Members>,
) {
    let mut linked: BTreeMap<u32, (u32, AbortHandle)> = BTreeMap::new();
    loop {
        let now = members.borrow_and_update().clone();
        let others = now.members.into_iter().filter(|m| m.number != own_number);
        let others: BTreeMap<u32, MemberAddress> = others.map(|m| (m.number, m)).collect();
        linked.retain(|number, (epoch, task)| {
            let is_there = others.get(number).is_some_and(|m| m.epoch == *epoch);
            if !is_there {
                task.abort();
            }
            is_there
        });
        for (number, member) in others {
            linked.entry(number).or_insert_with(|| {
                let epoch = member.epoch;
                let task = tokio::spawn(keep_link(Arc::clone(&asker), member));
                (epoch, task.abort_handle())
            });
        }
        if members.changed().await.is_err() {
            return;
        }
    }
}

/// Has a link to a member, again and again where it breaks: whether the member is dead is for the
/// console to say.
async fn keep_link(asker: Arc<Asker>, member: MemberAddress) {
    loop {
        if let Ok(link) = asker.connect(&member.address).await {
            let (requests, taken) = mpsc::channel(MAX_BATCHES_OUT);
            let open = asker.links.open(member.number as usize, requests);
            // What was asked and not answered is asked again over the next link.
            let _ = exchange(link, taken, asker.ticket.epoch).await;
            drop(open);
        }
        sleep(RETRY).await;
    }
}

impl Asker {
    async fn connect(&self, address: &str) -> Result<Link, HandshakeError> {
        let stream = timeout(HANDSHAKE_TIMEOUT, TcpStream::connect(address));
        let stream = stream.await.map_err(|_| HandshakeError::Timeout)??;
        let (session, traffic) = (self.ticket.session, Arc::clone(&self.traffic));
        let mut link = match &self.ticket.identity {
            None => Link::over_tcp(stream, session, traffic)?,
            Some(identity) => {
                let (connector, name) = identity.connector_to_worker()?;
                let stream = timeout(HANDSHAKE_TIMEOUT, connector.connect(name, stream));
                let stream = stream.await.map_err(|_| HandshakeError::Timeout)??;
                Link::over_tls(stream, session, traffic)?
            }
        };
        if join_owner(&mut link, &self.ticket).await? != self.scene_hash {
            return Err(HandshakeError::Refuses("it has another scene".into()));
        }
        Ok(link)
    }
}

/// Sends rays and hands out hits, until the link ends.
async fn exchange(
    link: Link,
    requests: mpsc::Receiver<Request>,
    epoch: u32,
) -> Result<(), FrameError> {
    let pending = Pending::default();
    let Link { reader, writer } = link;
    tokio::select! {
        sent = send_rays(writer, requests, &pending, epoch) => sent,
        received = receive_hits(reader, &pending) => received,
    }
}

async fn send_rays(
    mut writer: FrameWriter,
    mut requests: mpsc::Receiver<Request>,
    pending: &Pending,
    epoch: u32,
) -> Result<(), FrameError> {
    let mut number = 0_u16;
    while let Some(Request { batch, reply }) = requests.recv().await {
        // Numbers come again after 65,536 batches, of which only the last few are without answers.
        number = number.wrapping_add(1);
        pending.insert(number, reply);
        let frame = Frame {
            batch: number,
            ..Frame::new(FrameKind::Rays, epoch, batch)
        };
        writer.write(&frame).await?;
    }
    Ok(())
}

async fn receive_hits(mut reader: FrameReader, pending: &Pending) -> Result<(), FrameError> {
    loop {
        let frame = reader.read().await?;
        let reply = pending.remove(frame.batch);
        let Some(reply) = reply.filter(|_| frame.kind == FrameKind::Hits) else {
            return Err(FrameError::Unexpected {
                found: frame.kind,
                expected: "hits of rays that were asked",
            });
        };
        // Who asked may have been told to stop.
        let _ = reply.send(frame.body);
    }
}
