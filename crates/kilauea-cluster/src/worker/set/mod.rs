//! A worker that holds a part of a scene: asks the other members of its set what rays meet, and
//! answers them.
//!
//! Two members have two links, one for what each asks the other: rays go one way and hits the other, so
//! that hits never wait behind rays. Who answers waits for nobody, so that members which ask each other
//! go on.

mod answer;
mod ask;
mod links;
mod part;
mod serve;

use std::io;
use std::net::IpAddr;
use std::sync::Arc;

use kilauea_render::{Packing, PreparedScene};
use tokio::net::TcpListener;
use tokio::sync::{mpsc, watch};

use crate::link::Traffic;
use crate::protocol::{Frame, Members, Seat};
use crate::ticket::Ticket;
use answer::{Batch, MAX_BATCHES_WAITING, start_answering};
pub(super) use links::SetLinks;
pub(super) use part::{Part, receive_part};

/// Batches that a member may have at another without an answer: as many as keep it busy while answers
/// travel. A batch has at most 8,192 rays, so this is the credit that bounds what waits anywhere.
const MAX_BATCHES_OUT: usize = 4;

/// A worker's side of its set.
pub(super) struct SetSide {
    /// How the engine asks.
    pub(super) links: Arc<SetLinks>,
    /// Where others reach it.
    pub(super) address: String,
    members: watch::Sender<Members>,
    traffic: Arc<Traffic>,
}

/// What answers, once there is something to answer from.
pub(super) struct Answerers {
    batches: mpsc::Receiver<Batch>,
}

impl SetSide {
    /// Listens at an address of this machine, and links up with others as soon as it is told of them.
    pub(super) async fn open(
        ticket: &Ticket,
        seat: &Seat,
        scene_hash: [u8; 32],
        host: IpAddr,
    ) -> io::Result<(Self, Answerers)> {
        let listener = TcpListener::bind((host, 0)).await?;
        let address = listener.local_addr()?.to_string();
        let (members, heard) = watch::channel(Members::default());
        let traffic = Arc::new(Traffic::default());
        let links = Arc::new(SetLinks::default());
        let (sender, batches) = mpsc::channel(MAX_BATCHES_WAITING);
        let door = Arc::new(serve::Door {
            ticket: ticket.clone(),
            scene_hash,
            tls: match &ticket.identity {
                Some(identity) => Some(identity.acceptor()?),
                None => None,
            },
            traffic: Arc::clone(&traffic),
            members: heard.clone(),
            batches: sender,
        });
        tokio::spawn(serve::listen(listener, door));
        let asker = Arc::new(ask::Asker {
            ticket: ticket.clone(),
            scene_hash,
            traffic: Arc::clone(&traffic),
            links: Arc::clone(&links),
        });
        tokio::spawn(ask::keep_links(asker, seat.number, heard));
        let side = Self {
            links,
            address,
            members,
            traffic,
        };
        Ok((side, Answerers { batches }))
    }

    /// Who is in the set now.
    pub(super) fn set_members(&self, members: Members) {
        self.members.send_replace(members);
    }

    /// What went over links with other members.
    pub(super) fn traffic(&self) -> Arc<Traffic> {
        Arc::clone(&self.traffic)
    }
}

impl Drop for SetSide {
    fn drop(&mut self) {
        self.links.close();
    }
}

impl Answerers {
    /// Answers from a part of the scene, on so many threads, until the links are gone. `failed` takes
    /// what ends the frame.
    pub(super) fn start(
        self,
        prepared: &Arc<PreparedScene>,
        packing: Packing,
        n_threads: usize,
        failed: &mpsc::Sender<Frame>,
        epoch: u32,
    ) -> io::Result<()> {
        start_answering(self.batches, prepared, packing, n_threads, failed, epoch)
    }
}
