//! The interleavings of what crosses from thread to thread, as `loom` enumerates them: all with at
//! most three preemptions.
//!
//! Waiting has no time limit here, so a lost notification is a deadlock, which `loom` reports.
//! SPOTs, slots and cells do not appear: each thread has its own.

use loom::sync::Arc;
use loom::thread;
use std::num::NonZeroU32;

use crate::backlog::Backlog;
use crate::engine::Limits;
use crate::exchange::{Batch, Child, Exchange, Home, Progress, QuestionQueue};
use crate::inbox::Inbox;
use crate::priority::Order;
use crate::program::{Context, Pool, Program, Runtime};
use crate::slots::Ticket;
use crate::sync::{AtomicBool, AtomicUsize, Ordering};

/// Never runs; gives an exchange its types.
struct Nothing;

impl Program for Nothing {
    type Work = u32;
    type Output = u32;
    type Question = u32;
    type Answer = u32;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(u32, R::Context) -> R::Started {
        let pool = runtime.pool("nothing");
        move |work, cx| pool.start(async move { cx.ask(work).await })
    }
}

/// Runs `model` in every interleaving with at most three preemptions.
const TICKET: Ticket = Ticket {
    slot: 0,
    round: NonZeroU32::MIN,
};

fn check(model: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(3);
    builder.check(model);
}

fn exchange() -> Arc<Exchange<Nothing>> {
    let limits = Limits {
        n_threads: 2,
        budget_bytes: 0,
        questions_out: 1,
        batch_len: 1,
        stack_bytes: 0,
        order: Order::HighestGeneration,
    };
    Arc::new(Exchange::new(&limits, 1))
}

fn child(root: u64) -> Child<Nothing> {
    Child {
        work: 0,
        generation: 1,
        root,
        home: Home {
            thread: 0,
            spot: 0,
            ticket: TICKET,
        },
    }
}

#[test]
fn mail_arrives_once_and_ends_the_wait() {
    check(|| {
        let inbox = Arc::new(Inbox::new());
        let senders: Vec<_> = [1, 2]
            .into_iter()
            .map(|item| {
                let inbox = Arc::clone(&inbox);
                thread::spawn(move || inbox.put(item))
            })
            .collect();
        let mut mail = Vec::new();
        let mut received = Vec::new();
        while received.len() < 2 {
            inbox.take(&mut mail);
            if mail.is_empty() {
                inbox.wait(std::time::Duration::MAX);
            }
            received.append(&mut mail);
        }
        received.sort_unstable();
        assert_eq!(received, [1, 2]);
        senders.into_iter().for_each(|s| s.join().unwrap());
    });
}

#[test]
fn each_child_is_taken_once() {
    check(|| {
        let backlog = Arc::new(Backlog::new(Order::HighestGeneration));
        let thief = {
            let backlog = Arc::clone(&backlog);
            thread::spawn(move || {
                let loot: Vec<u32> = (0..2).filter_map(|_| backlog.steal()).collect();
                loot
            })
        };
        backlog.push(1, 0, [10, 11].into_iter());
        let mut taken = Vec::from_iter(backlog.pop_above(0));
        backlog.push(2, 0, [20].into_iter());
        taken.extend(backlog.pop_of(&[0]));
        taken.extend(thief.join().unwrap());
        taken.extend(std::iter::from_fn(|| backlog.pop_above(0)));
        taken.sort_unstable();
        assert_eq!(taken, [10, 11, 20]);
    });
}

#[test]
fn who_waits_to_steal_hears_of_every_child() {
    check(|| {
        let exchange = exchange();
        let thief = {
            let exchange = Arc::clone(&exchange);
            thread::spawn(
                move || {
                    while exchange.wait_for_mail_or_child(1).is_none() {}
                },
            )
        };
        exchange.backlogs[0].push(1, 0, std::iter::once(child(0)));
        exchange.offer();
        thief.join().unwrap();
    });
}

#[test]
fn who_is_out_of_memory_hears_of_every_privilege() {
    check(|| {
        let exchange = exchange();
        // Thread 1 has a child of root 5 and may start it only with a privilege.
        exchange.backlogs[1].push(1, 5, std::iter::once(child(5)));
        let waiting = {
            let exchange = Arc::clone(&exchange);
            thread::spawn(move || {
                let mut privileged = Vec::new();
                loop {
                    exchange.privileges.list(&mut privileged);
                    if exchange.backlogs[1].pop_of(&privileged).is_some() {
                        break;
                    }
                    exchange.wait_for_mail(1);
                }
            })
        };
        exchange.privilege(0, 5);
        waiting.join().unwrap();
    });
}

#[test]
fn the_last_root_ends_the_run_once() {
    check(|| {
        const N_ROOTS: u64 = 1;
        let progress = Arc::new(Progress::new());
        let n_ends = Arc::new(AtomicUsize::new(0));
        let n_done = Arc::new(AtomicUsize::new(0));
        let admit_all = {
            let (progress, n_ends, n_done) = (
                Arc::clone(&progress),
                Arc::clone(&n_ends),
                Arc::clone(&n_done),
            );
            move || {
                while let Some(number) = progress.reserve() {
                    if number < N_ROOTS {
                        n_done.fetch_add(1, Ordering::SeqCst);
                    } else {
                        progress.exhaust();
                    }
                    if progress.release() {
                        assert_eq!(n_done.load(Ordering::SeqCst), N_ROOTS as usize);
                        n_ends.fetch_add(1, Ordering::SeqCst);
                    }
                }
            }
        };
        let other = thread::spawn(admit_all.clone());
        admit_all();
        other.join().unwrap();
        assert!(n_ends.load(Ordering::SeqCst) >= 1);
    });
}

#[test]
fn every_batch_reaches_one_server_and_closing_reaches_all() {
    check(|| {
        let exchange = exchange();
        let n_served = Arc::new(AtomicUsize::new(0));
        let is_served = Arc::new(AtomicBool::new(false));
        let server = {
            let exchange = Arc::clone(&exchange);
            let (n_served, is_served) = (Arc::clone(&n_served), Arc::clone(&is_served));
            thread::spawn(move || {
                while let Some(batch) = exchange.questions[0].pop() {
                    n_served.fetch_add(batch.questions.len(), Ordering::SeqCst);
                    is_served.store(true, Ordering::SeqCst);
                    exchange.inboxes[0].wake();
                }
            })
        };
        let questions: &QuestionQueue<u32> = &exchange.questions[0];
        questions.push(Batch {
            thread: 0,
            questions: vec![(TICKET, 1)],
        });
        while !is_served.load(Ordering::SeqCst) {
            exchange.wait_for_mail(0);
        }
        exchange.end(None);
        server.join().unwrap();
        assert_eq!(n_served.load(Ordering::SeqCst), 1);
    });
}
