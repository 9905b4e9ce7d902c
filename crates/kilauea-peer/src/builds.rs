use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;
use std::time::Instant;

use crate::{Device, Embree, EmbreeScene, Mode, Ours, PeerError, Workload};

/// A build is repeated until it has taken this long, but no more often than [`MAX_BUILDS`].
const MIN_SECS: f64 = 1.0;
const MAX_BUILDS: usize = 10;

/// How long a tree takes to build, and how big it is.
#[derive(Clone, Debug, Serialize)]
pub struct BuildRow {
    /// Name of the mesh.
    pub mesh: String,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Whose tree, and in which mode.
    pub builder: String,
    /// Threads that build.
    pub threads: usize,
    /// The shortest of several builds, from arrays in memory to a tree that can be traced.
    pub seconds: f64,
    /// Memory of the tree over the number of triangles. Except in Embree's compact mode, trees
    /// hold copies of the triangles; the mesh itself is not counted.
    pub bytes_per_triangle: f64,
}

impl BuildRow {
    /// Builds each kind of tree on `n_threads`.
    pub fn of_all(
        embree: &Embree,
        workload: &Workload,
        n_threads: usize,
    ) -> Result<Vec<Self>, PeerError> {
        let Workload { name, mesh, .. } = workload;
        let row = |builder: String, (seconds, n_bytes): (f64, usize)| Self {
            mesh: name.clone(),
            triangles: mesh.triangles().len(),
            builder,
            threads: n_threads,
            seconds,
            bytes_per_triangle: n_bytes as f64 / mesh.triangles().len() as f64,
        };
        let pool = thread_pool(n_threads)?;
        let mut rows = Vec::new();
        let build = || Ok(pool.install(|| Ours::build(mesh)));
        rows.push(row(Ours::NAME.into(), fastest(build, Ours::n_bytes)?));
        drop(pool);
        let device = Device::new(embree, n_threads)?;
        for mode in Mode::ALL {
            let build = || EmbreeScene::build(&device, mesh, mode);
            let builder = format!("{} {}", device.name(), mode.name);
            rows.push(row(builder, fastest(build, EmbreeScene::n_bytes)?));
        }
        Ok(rows)
    }
}

/// Threads for our builds.
fn thread_pool(n_threads: usize) -> Result<ThreadPool, PeerError> {
    ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .map_err(|_| PeerError::Threads { n_threads })
}

/// Seconds of the fastest build, and bytes of what it made.
fn fastest<T>(
    build: impl Fn() -> Result<T, PeerError>,
    n_bytes: impl Fn(&T) -> usize,
) -> Result<(f64, usize), PeerError> {
    let mut best = f64::INFINITY;
    let mut total = 0.0;
    let mut bytes = 0;
    for _ in 0..MAX_BUILDS {
        let start = Instant::now();
        let tree = build()?;
        let secs = start.elapsed().as_secs_f64();
        bytes = n_bytes(&tree);
        best = best.min(secs);
        total += secs;
        if total >= MIN_SECS {
            break;
        }
    }
    Ok((best, bytes))
}
