//! Bytes that go one way through a proxy: one thread takes them, another lets them go when it is time.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use super::{Direction, Passage, Shared, lock};

/// Bytes that travel together.
const PIECE_BYTES: usize = 4096;
/// Pieces under way: beyond 4 MiB the sender waits, as for a router whose queue is full.
const MAX_PIECES: usize = 1024;

/// Bytes, and when they came.
struct Piece {
    came: Instant,
    /// Place of the first in all that was sent.
    offset: u64,
    bytes: Vec<u8>,
}

/// Carries bytes until one end is closed or the proxy is over.
pub(super) fn start(from: TcpStream, to: TcpStream, direction: Direction, shared: &Arc<Shared>) {
    let (sender, pieces) = sync_channel(MAX_PIECES);
    let shared = Arc::clone(shared);
    thread::spawn(move || take(from, &sender));
    thread::spawn(move || {
        let _ = let_go(&pieces, &to, direction, &shared);
        // What one end has closed is closed at the other, once all is there.
        let _ = to.shutdown(Shutdown::Write);
    });
}

fn take(mut from: TcpStream, pieces: &SyncSender<Piece>) {
    let mut offset = 0;
    let mut bytes = [0; PIECE_BYTES];
    while let Ok(n) = from.read(&mut bytes) {
        let piece = Piece {
            came: Instant::now(),
            offset,
            bytes: bytes[..n].to_vec(),
        };
        if n == 0 || pieces.send(piece).is_err() {
            break;
        }
        offset += n as u64;
    }
    let _ = from.shutdown(Shutdown::Read);
}

fn let_go(
    pieces: &Receiver<Piece>,
    mut to: &TcpStream,
    direction: Direction,
    shared: &Shared,
) -> io::Result<()> {
    let mut is_free_at = Instant::now();
    for Piece {
        came,
        offset,
        mut bytes,
    } in pieces
    {
        let Some(way) = shared.wait_for_passage(direction) else {
            return Ok(());
        };
        let n = bytes.len();
        if let Some(rate) = way.bytes_per_sec {
            // A card that sends one piece after the other.
            is_free_at = is_free_at.max(came) + Duration::from_secs_f64(n as f64 / rate);
            sleep_until(is_free_at + way.delay);
        } else {
            sleep_until(came + way.delay);
        }
        if way
            .flip_at
            .is_some_and(|at| (offset..offset + n as u64).contains(&at))
        {
            let at = lock(&shared.ways)[direction as usize].flip_at.take();
            if let Some(at) = at {
                bytes[(at - offset) as usize] ^= 1;
            }
        }
        if way.passage == Passage::Open {
            to.write_all(&bytes)?;
        }
    }
    Ok(())
}

fn sleep_until(time: Instant) {
    thread::sleep(time.saturating_duration_since(Instant::now()));
}
