//! A proxy between a worker and its console that does to their bytes what networks do.
#![allow(dead_code, reason = "each test uses a part")]

mod frames;
mod pump;

use std::io;
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use kilauea_cluster::protocol::Frame;

/// How often the proxy looks whether it is still needed.
const MOMENT: Duration = Duration::from_millis(5);

/// Which way bytes go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    ToConsole = 0,
    ToWorker = 1,
}

/// What becomes of bytes that go one way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Way {
    pub(crate) passage: Passage,
    /// All of them are late by this.
    pub(crate) delay: Duration,
    /// So many pass in a second; all if absent.
    pub(crate) bytes_per_sec: Option<f64>,
    /// Of the next connection that sends so many bytes, the byte there has a bit flipped.
    pub(crate) flip_at: Option<u64>,
}

/// Whether bytes pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Passage {
    #[default]
    Open,
    /// They wait and pass later, as over TCP where a network is parted for a while.
    Stalled,
    /// They vanish, and who sends them does not know.
    Blackhole,
}

/// Makes other frames of those that a worker sends, as somebody could who knows the protocol.
pub(crate) type Rewrite = Box<dyn FnMut(Frame) -> Vec<Frame> + Send>;

/// A proxy in front of a console. Ends, and all connections with it, when it is dropped.
pub(crate) struct Proxy {
    address: SocketAddr,
    shared: Arc<Shared>,
}

/// What connections look at.
pub(crate) struct Shared {
    ways: Mutex<[Way; 2]>,
    changed: Condvar,
    is_over: AtomicBool,
    connections: Mutex<Vec<TcpStream>>,
    rewrite: Mutex<Option<Rewrite>>,
}

impl Proxy {
    /// A proxy that passes all on.
    pub(crate) fn new(console: &str) -> Self {
        Self::start(console, None).expect("loopback has ports")
    }

    /// One that rewrites what goes to the console.
    pub(crate) fn rewriting(console: &str, rewrite: Rewrite) -> Self {
        Self::start(console, Some(rewrite)).expect("loopback has ports")
    }

    fn start(console: &str, rewrite: Option<Rewrite>) -> io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared {
            ways: Mutex::default(),
            changed: Condvar::new(),
            is_over: AtomicBool::new(false),
            connections: Mutex::default(),
            rewrite: Mutex::new(rewrite),
        });
        let console = console.to_owned();
        thread::spawn({
            let shared = Arc::clone(&shared);
            move || accept(&listener, &console, &shared)
        });
        Ok(Self { address, shared })
    }

    /// Where workers find the console from now on.
    pub(crate) fn address(&self) -> String {
        self.address.to_string()
    }

    /// Changes what becomes of bytes that go one way.
    pub(crate) fn set(&self, direction: Direction, way: Way) {
        self.shared.ways()[direction as usize] = way;
        self.shared.changed.notify_all();
    }

    /// The same both ways.
    pub(crate) fn set_both(&self, way: &Way) {
        for direction in [Direction::ToConsole, Direction::ToWorker] {
            self.set(direction, way.clone());
        }
    }

    /// Closes all connections there are.
    pub(crate) fn cut(&self) {
        for stream in lock(&self.shared.connections).drain(..) {
            // It may be closed already.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
        self.cut();
    }
}

impl Shared {
    fn ways(&self) -> MutexGuard<'_, [Way; 2]> {
        lock(&self.ways)
    }

    fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }

    /// The way as it is, once bytes pass or vanish; none where the proxy ends first.
    fn wait_for_passage(&self, direction: Direction) -> Option<Way> {
        let is_stalled = |ways: &mut [Way; 2]| {
            ways[direction as usize].passage == Passage::Stalled && !self.is_over()
        };
        let ways = self.changed.wait_while(self.ways(), is_stalled);
        let ways = ways.unwrap_or_else(PoisonError::into_inner);
        (!self.is_over()).then(|| ways[direction as usize].clone())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn accept(listener: &TcpListener, console: &str, shared: &Arc<Shared>) {
    while !shared.is_over() {
        match listener.accept() {
            // A console that is gone lets nobody in, which the worker finds out.
            Ok((worker, _)) => drop(connect(worker, console, shared)),
            Err(_) => thread::sleep(MOMENT),
        }
    }
}

fn connect(worker: TcpStream, console: &str, shared: &Arc<Shared>) -> io::Result<()> {
    worker.set_nonblocking(false)?;
    let console = TcpStream::connect(console)?;
    for stream in [&worker, &console] {
        stream.set_nodelay(true)?;
        lock(&shared.connections).push(stream.try_clone()?);
    }
    let (worker_out, console_out) = (worker.try_clone()?, console.try_clone()?);
    let rewrite = lock(&shared.rewrite).take();
    match rewrite {
        Some(rewrite) => {
            thread::spawn(move || frames::rewrite(worker, console_out, rewrite));
        }
        None => pump::start(worker, console_out, Direction::ToConsole, shared),
    }
    pump::start(console, worker_out, Direction::ToWorker, shared);
    Ok(())
}
