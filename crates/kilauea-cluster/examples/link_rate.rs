//! How many rays a second get through one link and are answered, by the size of batches:
//! `cargo run --release -p kilauea-cluster --example link_rate -- [SECONDS]`.
//!
//! One connection over loopback within this process, with frames as members of a set send them. A ray is
//! 32 bytes, its hit 16, and nobody traces or packs any: that is the link alone.
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

use std::error::Error;
use std::io;
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use kilauea_cluster::link::{Link, Traffic};
use kilauea_cluster::protocol::{Frame, FrameError, FrameKind};
use tokio::runtime::{Builder, Runtime};

const BYTES_PER_RAY: usize = 32;
const BYTES_PER_HIT: usize = 16;
const RAYS_PER_BATCH: [usize; 6] = [1, 16, 128, 512, 1024, 2048];
/// Batches under way, of which members of a set have four.
const CREDITS: [usize; 2] = [4, 16];

fn main() -> Result<(), Box<dyn Error>> {
    let secs: f64 = std::env::args()
        .nth(1)
        .map_or(Ok(1.0), |secs| secs.parse())?;
    for credits in CREDITS {
        for n_rays in RAYS_PER_BATCH {
            let rate = measure(n_rays, credits, Duration::from_secs_f64(secs))?;
            let millions = 1e-6 * rate;
            println!("{credits} batches of {n_rays} rays: {millions:.2} million rays a second");
        }
    }
    Ok(())
}

/// Rays a second between two threads, which wait for bytes as two processes do.
fn measure(n_rays: usize, credits: usize, time: Duration) -> Result<f64, Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let asker = TcpStream::connect(listener.local_addr()?)?;
    let (owner, _) = listener.accept()?;
    let owner = thread::spawn(move || runtime()?.block_on(answer(owner, n_rays)));
    let rate = runtime()?.block_on(ask(asker, n_rays, credits, time))?;
    // It ends with the link, and says so.
    drop(owner.join());
    Ok(rate)
}

fn runtime() -> io::Result<Runtime> {
    Builder::new_current_thread().enable_all().build()
}

fn link(stream: TcpStream) -> io::Result<Link> {
    stream.set_nonblocking(true)?;
    let stream = tokio::net::TcpStream::from_std(stream)?;
    Link::over_tcp(stream, 0, Arc::<Traffic>::default())
}

async fn ask(
    stream: TcpStream,
    n_rays: usize,
    credits: usize,
    time: Duration,
) -> Result<f64, FrameError> {
    let Link {
        mut reader,
        mut writer,
    } = link(stream)?;
    for _ in 0..credits {
        writer.write(&rays(n_rays)).await?;
    }
    let start = Instant::now();
    let mut n_batches = 0;
    while start.elapsed() < time {
        reader.read().await?;
        writer.write(&rays(n_rays)).await?;
        n_batches += 1;
    }
    Ok(f64::from(n_batches) * n_rays as f64 / start.elapsed().as_secs_f64())
}

/// Answers until the link ends.
async fn answer(stream: TcpStream, n_rays: usize) -> Result<(), FrameError> {
    let Link {
        mut reader,
        mut writer,
    } = link(stream)?;
    loop {
        let frame = reader.read().await?;
        let hits = Frame {
            batch: frame.batch,
            ..Frame::new(FrameKind::Hits, 0, vec![1; n_rays * BYTES_PER_HIT])
        };
        writer.write(&hits).await?;
    }
}

fn rays(n_rays: usize) -> Frame {
    Frame::new(FrameKind::Rays, 0, vec![1; n_rays * BYTES_PER_RAY])
}
