//! The links to other members as engine threads see them.

use std::collections::HashMap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use kilauea_render::{Partners, PartnersGone};
use tokio::sync::{mpsc, oneshot};

use super::MAX_BATCHES_OUT;

/// A batch on its way to a member, and where its answer goes.
pub(super) struct Request {
    pub(super) batch: Vec<u8>,
    pub(super) reply: oneshot::Sender<Vec<u8>>,
}

/// The links to other members, which may be gone for a while.
#[derive(Default)]
pub(crate) struct SetLinks {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// By number of the member.
    open: HashMap<usize, mpsc::Sender<Request>>,
    is_closed: bool,
}

/// A link that is there until this is dropped.
pub(super) struct OpenLink<'a> {
    links: &'a SetLinks,
    member: usize,
    requests: mpsc::Sender<Request>,
}

impl SetLinks {
    /// A member can be asked from now on, by way of `requests`.
    pub(super) fn open(&self, member: usize, requests: mpsc::Sender<Request>) -> OpenLink<'_> {
        self.lock().open.insert(member, requests.clone());
        self.changed.notify_all();
        OpenLink {
            links: self,
            member,
            requests,
        }
    }

    /// Nobody can be asked any more.
    pub(crate) fn close(&self) {
        let mut state = self.lock();
        state.is_closed = true;
        // Who waits for an answer is told that none comes.
        state.open.clear();
        self.changed.notify_all();
    }

    /// Waits until a member can be asked.
    fn requests_of(&self, member: usize) -> Result<mpsc::Sender<Request>, PartnersGone> {
        let is_missing = |state: &mut State| !state.is_closed && !state.open.contains_key(&member);
        let waited = self.changed.wait_while(self.lock(), is_missing);
        let state = waited.unwrap_or_else(PoisonError::into_inner);
        state.open.get(&member).cloned().ok_or(PartnersGone)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for OpenLink<'_> {
    fn drop(&mut self) {
        let open = &mut self.links.lock().open;
        // Another life of the member may have taken the place.
        let is_this = |requests: &mpsc::Sender<Request>| requests.same_channel(&self.requests);
        if open.get(&self.member).is_some_and(is_this) {
            open.remove(&self.member);
        }
    }
}

impl Partners for SetLinks {
    /// Asks again where a link ends before the answer is there: a member's successor has the same
    /// chunks, and so the same answer.
    fn ask(&self, member: usize, batch: Vec<u8>) -> Result<Vec<u8>, PartnersGone> {
        loop {
            let requests = self.requests_of(member)?;
            let (reply, answer) = oneshot::channel();
            let batch = batch.clone();
            if requests.blocking_send(Request { batch, reply }).is_err() {
                continue;
            }
            drop(requests);
            if let Ok(answer) = answer.blocking_recv() {
                return Ok(answer);
            }
        }
    }

    fn n_batches_out(&self) -> usize {
        MAX_BATCHES_OUT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread::scope;

    #[test]
    fn who_asks_a_member_that_is_gone_is_answered_by_its_successor() {
        let links = SetLinks::default();
        scope(|threads| {
            let asked = threads.spawn(|| links.ask(1, vec![7]));
            for is_there_to_answer in [false, true] {
                let (requests, mut taken) = mpsc::channel(1);
                let link = links.open(1, requests);
                let Request { batch, reply } = taken.blocking_recv().expect("it is asked");
                assert_eq!(batch, [7]);
                drop(link);
                if is_there_to_answer {
                    reply.send(vec![8]).expect("it waits");
                }
            }
            assert_eq!(asked.join().expect("no panic"), Ok(vec![8]));
        });
    }

    #[test]
    fn nobody_waits_for_a_set_that_is_no_more() {
        let links = SetLinks::default();
        scope(|threads| {
            let asked = [0, 1].map(|member| {
                threads.spawn({
                    let links = &links;
                    move || links.ask(member, vec![7])
                })
            });
            let (requests, mut taken) = mpsc::channel(1);
            let link = links.open(0, requests);
            let request = taken.blocking_recv().expect("it is asked");
            links.close();
            drop((request, link));
            for asked in asked {
                assert_eq!(asked.join().expect("no panic"), Err(PartnersGone));
            }
        });
    }
}
