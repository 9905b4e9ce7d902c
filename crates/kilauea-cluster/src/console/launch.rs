//! Starts workers.

use std::ffi::OsString;
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
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
#[derive(Debug)]
pub(crate) struct WorkerProcess {
    child: Child,
    /// Takes a ticket for each frame.
    tickets: ChildStdin,
}

impl WorkerProcess {
    fn start(program: &Path, arguments: &[OsString]) -> io::Result<Self> {
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            // An interrupt is for the console: workers end with their links.
            .process_group(0)
            .spawn()?;
        let tickets = child.stdin.take();
        let tickets = tickets.ok_or_else(|| io::Error::other("a worker has no input"))?;
        Ok(Self { child, tickets })
    }

    pub(super) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// What became of it, if it has ended.
    pub(crate) fn ended(&mut self) -> Option<String> {
        match self.child.try_wait() {
            Ok(None) => None,
            Ok(Some(status)) => Some(format!("its process ended: {status}")),
            Err(error) => Some(format!("its process is gone: {error}")),
        }
    }
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        // It may have ended by itself, which is as well.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Starts the worker that a ticket is for, or has one that is idle take it.
pub(super) fn launch(
    kind: &WorkerKind,
    ticket: &Ticket,
    idle: Option<WorkerProcess>,
) -> io::Result<Launched> {
    match kind {
        WorkerKind::Elsewhere { .. } => Ok(Launched::Elsewhere),
        WorkerKind::Threads => launch_thread(ticket.clone()).map(Launched::Thread),
        WorkerKind::Processes { program, arguments } => {
            let mut process = match idle {
                Some(process) => process,
                None => WorkerProcess::start(program, arguments)?,
            };
            let line = serde_json::to_string(ticket).map_err(io::Error::other)?;
            // Where it has ended already, that is found out as of any worker.
            let _ = writeln!(process.tickets, "{line}");
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
            let _ = runtime().map(|runtime| runtime.block_on(work(link, &ticket, HERE, None)));
        })?;
    Ok(ours)
}
