//! Starts workers.

use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::thread;

use crate::link::{Link, Traffic, channel};
use crate::options::WorkerKind;
use crate::ticket::Ticket;
use crate::worker::{HERE, runtime, work};

/// A worker that was started.
pub(super) enum Launched {
    /// It will connect.
    Process(WorkerProcess),
    /// Our end of the channel to it.
    Thread(tokio::io::DuplexStream),
    /// Somebody else will.
    Elsewhere,
}

/// A process that ends with this value.
pub(super) struct WorkerProcess(Child);

impl WorkerProcess {
    pub(super) fn pid(&self) -> u32 {
        self.0.id()
    }

    /// What became of it, if it has ended.
    pub(super) fn ended(&mut self) -> Option<String> {
        match self.0.try_wait() {
            Ok(None) => None,
            Ok(Some(status)) => Some(format!("its process ended: {status}")),
            Err(error) => Some(format!("its process is gone: {error}")),
        }
    }
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        // It may have ended by itself, which is as well.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts the worker that a ticket is for.
pub(super) fn launch(kind: &WorkerKind, ticket: &Ticket) -> io::Result<Launched> {
    match kind {
        WorkerKind::Elsewhere { .. } => Ok(Launched::Elsewhere),
        WorkerKind::Threads => launch_thread(ticket.clone()).map(Launched::Thread),
        WorkerKind::Processes { program, arguments } => {
            let mut child = Command::new(program)
                .args(arguments)
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                // An interrupt is for the console: workers end with their links.
                .process_group(0)
                .spawn()?;
            let stdin = child.stdin.take();
            let process = WorkerProcess(child);
            let line = serde_json::to_string(ticket).map_err(io::Error::other)?;
            let mut stdin = stdin.ok_or_else(|| io::Error::other("a worker has no input"))?;
            // Where it has ended already, that is found out as of any worker.
            let _ = writeln!(stdin, "{line}");
            Ok(Launched::Process(process))
        }
    }
}

fn launch_thread(ticket: Ticket) -> io::Result<tokio::io::DuplexStream> {
    let (ours, theirs) = channel();
    thread::Builder::new()
        .name("worker link".into())
        .spawn(move || {
            let link = Link::over_channel(theirs, ticket.session, Arc::new(Traffic::default()));
            // The console sees that the link ends, and says what that means for the frame.
            let _ = runtime().map(|runtime| runtime.block_on(work(link, &ticket, HERE)));
        })?;
    Ok(ours)
}
