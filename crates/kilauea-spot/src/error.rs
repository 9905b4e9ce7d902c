//! Why a run ended early.

use std::any::Any;

use crate::wire::WireError;

/// Why a run ended before all roots were done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// [`Job::is_cancelled`](crate::Job::is_cancelled) said so.
    #[error("cancelled")]
    Cancelled,
    /// The code of a SPOT panicked.
    #[error("{label} panicked: {message}")]
    Panicked {
        /// The label of the pool that the SPOT was started in.
        label: String,
        /// The message of the panic.
        message: String,
    },
    /// A SPOT awaits something that did not come from its context.
    #[error("{label} awaits neither an answer nor a child")]
    Stuck {
        /// The label of the pool that the SPOT was started in.
        label: String,
    },
    /// Code outside SPOTs panicked: an answerer, the job, or a program's `starter`.
    #[error("{thread} panicked: {message}")]
    ThreadPanicked {
        /// The name of the thread.
        thread: String,
        /// The message of the panic.
        message: String,
    },
    /// Questions or answers did not survive their way as bytes.
    #[error("batch of {n_bytes} bytes cannot be read: {source}")]
    Malformed {
        /// Length of the batch.
        n_bytes: usize,
        /// What is wrong with it.
        source: WireError,
    },
    /// A holder of a part of the data cannot be asked any more.
    #[error("holder {part} does not answer: {reason}")]
    Unanswered {
        /// The part.
        part: usize,
        /// Why not.
        reason: String,
    },
    /// The system gave no thread.
    #[error("cannot start thread {thread}: {message}")]
    NoThread {
        /// The name of the thread.
        thread: String,
        /// What the system said.
        message: String,
    },
}

/// The message of a panic.
pub(crate) fn panic_message(payload: &(dyn Any + Send)) -> String {
    if let Some(text) = payload.downcast_ref::<&str>() {
        (*text).to_owned()
    } else if let Some(text) = payload.downcast_ref::<String>() {
        text.clone()
    } else {
        "panic without a message".to_owned()
    }
}
