//! Answers Prometheus on a thread of its own.

use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Notify, Semaphore};
use tokio::time::timeout;

use super::board::Board;
use super::families::page;
use super::http::{MAX_REQUEST_BYTES, answer, too_long};
use crate::job::ClusterJob;
use crate::worker::runtime;

/// Connections that are served at once; others wait.
const MAX_CONNECTIONS: usize = 8;
/// Time for a request and its answer.
const REQUEST_TIME: Duration = Duration::from_secs(2);

/// Serves `http://ADDRESS/metrics` until it is dropped.
#[derive(Debug)]
pub struct MetricsServer {
    address: SocketAddr,
    board: Arc<Mutex<Board>>,
    stop: Arc<Notify>,
    thread: Option<JoinHandle<()>>,
}

impl MetricsServer {
    /// Listens at an address as `127.0.0.1:9100`; port 0 takes any. Whoever reaches it may read.
    pub fn bind(address: &str) -> io::Result<Self> {
        let runtime = runtime()?;
        let listener = runtime.block_on(TcpListener::bind(address))?;
        let address = listener.local_addr()?;
        let (board, stop) = (Arc::<Mutex<Board>>::default(), Arc::new(Notify::new()));
        let thread = thread::Builder::new().name("metrics".into()).spawn({
            let (board, stop) = (Arc::clone(&board), Arc::clone(&stop));
            move || {
                runtime.block_on(async {
                    tokio::select! {
                        () = listen(listener, board) => {}
                        () = stop.notified() => {}
                    }
                });
            }
        })?;
        Ok(Self {
            address,
            board,
            stop,
            thread: Some(thread),
        })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Shows a frame from now on, and adds what was counted for the last one to the totals.
    pub fn watch(&self, job: &ClusterJob) {
        let mut board = self.board.lock().unwrap_or_else(PoisonError::into_inner);
        board.begin(Arc::clone(job.status()));
    }
}

impl Drop for MetricsServer {
    fn drop(&mut self) {
        self.stop.notify_one();
        if let Some(thread) = self.thread.take() {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

async fn listen(listener: TcpListener, board: Arc<Mutex<Board>>) {
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        let Ok((stream, _)) = listener.accept().await else {
            // Out of descriptors, say: others may end meanwhile.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let board = Arc::clone(&board);
        tokio::spawn(async move {
            // One that is slow, or gone, asks again.
            let _ = timeout(REQUEST_TIME, serve(stream, &board)).await;
            drop(place);
        });
    }
}

async fn serve(mut stream: TcpStream, board: &Mutex<Board>) -> io::Result<()> {
    let mut head = Vec::new();
    let is_whole = |head: &[u8]| head.windows(4).any(|bytes| bytes == b"\r\n\r\n");
    while !is_whole(&head) && head.len() < MAX_REQUEST_BYTES {
        let mut bytes = [0; 1024];
        match stream.read(&mut bytes).await? {
            0 => break,
            n => head.extend_from_slice(&bytes[..n]),
        }
    }
    let answer = if head.len() < MAX_REQUEST_BYTES {
        answer(&head, || {
            page(&board.lock().unwrap_or_else(PoisonError::into_inner).view())
        })
    } else {
        too_long()
    };
    stream.write_all(&answer).await?;
    stream.shutdown().await
}
