//! Sequential code that waits without holding a thread: a dataflow engine.
//!
//! Code that asks for data it does not have must wait, and many that wait must not keep a core
//! idle. Kato & Saito (*Parallel global illumination renderer "Kilauea"*, 2002, section 4) cut
//! such code into SPOTs, pieces that run once all their slots are filled. Here a compiler makes the
//! cuts: a SPOT is an `async fn`, each answer that it has asked for is a slot, and when the last
//! slot is filled it goes on. It is written as if nothing ever waited:
//!
//! ```
//! use kilauea_spot::{Answerer, Context, Engine, Job, Pool, Program, Queue, Runtime};
//! # use std::sync::Mutex;
//!
//! /// Sums the weights of a binary tree whose node `n` has the children `2 n` and `2 n + 1`.
//! struct TreeSum {
//!     n_nodes: u64,
//! }
//!
//! impl TreeSum {
//!     async fn inner<C: Context<Self>>(&self, node: u64, cx: C) -> f64 {
//!         let weight = cx.ask(node); // ask first ...
//!         let left = cx.spawn(2 * node);
//!         let right = cx.spawn(2 * node + 1);
//!         weight.await + left.await + right.await // ... read later
//!     }
//! }
//!
//! async fn leaf<C: Context<TreeSum>>(node: u64, cx: C) -> f64 {
//!     cx.ask(node).await
//! }
//!
//! impl Program for TreeSum {
//!     type Work = u64;
//!     type Output = f64;
//!     type Question = u64;
//!     type Answer = f64;
//!
//!     fn starter<'a, R: Runtime<'a, Self>>(
//!         &'a self,
//!         runtime: &R,
//!     ) -> impl Fn(u64, R::Context) -> R::Started {
//!         let (inners, leaves) = (runtime.pool("inner node"), runtime.pool("leaf"));
//!         move |node, cx| {
//!             if 2 * node + 1 <= self.n_nodes {
//!                 inners.start(self.inner(node, cx))
//!             } else {
//!                 leaves.start(leaf(node, cx))
//!             }
//!         }
//!     }
//! }
//!
//! /// Who knows the weights: this memory, another thread, another machine.
//! struct Weights;
//!
//! impl Answerer<TreeSum> for Weights {
//!     fn answer(&self, node: u64) -> f64 {
//!         1.0 / node as f64
//!     }
//! }
//! # struct WholeTree(Mutex<f64>);
//! # impl Job<TreeSum> for WholeTree {
//! #     fn root(&self, number: u64) -> Option<u64> {
//! #         (number == 0).then_some(1)
//! #     }
//! #     fn done(&self, _: u64, output: f64) {
//! #         *self.0.lock().unwrap() = output;
//! #     }
//! # }
//!
//! let program = TreeSum { n_nodes: 1023 };
//! let engine = Engine::new(2).budget_bytes(1 << 20);
//! # let job = WholeTree(Mutex::new(0.0));
//! engine.run_inline(&program, &Weights, &job)?;
//! # let inline = *job.0.lock().unwrap();
//! engine.run_queued(&program, &Queue::new(&Weights), 1, &job)?; // the same bits
//! # assert_eq!(inline, *job.0.lock().unwrap());
//! # assert!(inline > 7.0);
//! # Ok::<(), kilauea_spot::RunError>(())
//! ```
//!
//! # Three ways
//!
//! | way | questions | children | for |
//! |---|---|---|---|
//! | [`Engine::run_inline`] | answered within the call | run within the call | all data at hand; debugging |
//! | [`Engine::run_queued`] with [`Queue`] | in batches to other threads | SPOTs of their own | answers worth batching |
//! | [`Engine::run_queued`] with [`Bytes`], or another [`Server`] | in batches, as bytes | SPOTs of their own | data elsewhere |
//! | [`Engine::run_queued`] with [`Split`] | in batches, to several who answer together | SPOTs of their own | data in parts |
//!
//! The program is the same and so are the bits of its outputs, if it keeps to this: an answer
//! depends on its question alone, a SPOT on its work and its answers, and answers are combined in
//! the order in which they were asked for, which is what `await` in a row does.
//!
//! # Life of a SPOT
//!
//! It begins as a [`Program::Work`], a plain description. An engine thread makes a future of it and
//! puts that into a *cell* of the pool for its type. A SPOT never leaves its thread, so slots, cells
//! and counters need no locks; what other threads may steal is works that nobody has started. It is
//! WAIT while a slot is open and ACTIVE once none is; when its code ends and its last child is home
//! it is DEAD, and its cell, slots and entry are used again. A question whose future is dropped
//! gives its slot back at once; the late answer finds a ticket of an earlier round and goes nowhere.
//!
//! # Order and memory
//!
//! A thread always takes what has the highest generation (section 4.2 of the paper), of ACTIVE SPOTs
//! that are equal in this the one that became so last, and admits new roots only when there is nothing else to do and its share of the budget is not half used. That
//! alone does not bound memory when answers take time: all roots advance together. So there are
//! two more rules. The number of roots in flight follows what they are seen to lead to, and while
//! memory is short only the work of a few *privileged* roots goes on, until they end. Memory passes
//! the budget by no more than what as many roots as there are threads lead to.
//!
//! # Why nothing waits forever
//!
//! The engine's queues are bounded by what their senders already hold, so no sender waits for room;
//! byte channels are bounded by a count:
//!
//! | queue | bounded by | who waits |
//! |---|---|---|
//! | a thread's ACTIVE SPOTs, unstarted children, unsent questions | its share of the budget | nobody |
//! | batches to servers | the sum of the threads' credits ([`Engine::questions_out`]) | servers, while it is empty |
//! | slow questions of a [`Queue`] | the same credits | those who answer them, while it is empty |
//! | a thread's mail | its credit, and the children that others may steal from it | its owner, with nothing to do |
//! | the byte channels of [`Bytes`] | four batches | each for the next; the last for nobody |
//!
//! Engine threads wait for mail alone, which servers and other engine threads send without waiting.
//! A root with the privilege is advanced by every thread whatever its memory, so it ends.
//! `loom` checks the interleavings of mail, theft, privileges and endings, with up to three
//! preemptions (`make test-loom`).
//!
//! # When something fails
//!
//! A SPOT that panics ends the run with [`RunError::Panicked`], which carries the label of its
//! pool; other threads finish the SPOT they are running and stop. The same goes for
//! servers that panic, bytes that cannot be read, and [`Job::is_cancelled`].

#![forbid(unsafe_code)]

mod backlog;
mod budget;
mod bytes;
mod cells;
mod delayed;
mod departures;
mod engine;
mod error;
mod exchange;
mod inbox;
mod inline;
#[cfg(all(test, loom))]
mod interleavings;
mod lane;
mod parts;
mod priority;
mod program;
mod queued;
mod server;
mod slots;
mod stats;
mod sync;
mod thread;
mod wire;

pub use bytes::{Bytes, decode_batch, encode_batch};
pub use delayed::Delayed;
pub use departures::Route;
pub use engine::Engine;
pub use error::RunError;
pub use exchange::Batch;
pub use inline::{Inline, InlinePool};
pub use parts::{PART_BATCH, Parts, Split};
pub use priority::Order;
pub use program::{Answerer, Context, Job, Pool, Program, Runtime};
pub use queued::{ChildOutput, Queued, QueuedContext, QueuedPool, Reply, Started};
pub use server::{Desk, Queue, Server};
pub use slots::Ticket;
pub use stats::{Stats, ThreadStats};
pub use wire::{Wire, WireError};
