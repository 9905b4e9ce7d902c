//! Sequential code that waits without holding a thread.

#![forbid(unsafe_code)]

mod backlog;
mod budget;
mod bytes;
mod cells;
mod engine;
mod error;
mod exchange;
mod inbox;
mod inline;
#[cfg(all(test, loom))]
mod interleavings;
mod lane;
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
pub use engine::Engine;
pub use error::RunError;
pub use exchange::Batch;
pub use inline::{Inline, InlinePool};
pub use priority::Order;
pub use program::{Answerer, Context, Job, Pool, Program, Runtime};
pub use queued::{ChildOutput, Queued, QueuedContext, QueuedPool, Reply, Started};
pub use server::{Desk, Queue, Server};
pub use slots::Ticket;
pub use stats::{Stats, ThreadStats};
pub use wire::{Wire, WireError};
