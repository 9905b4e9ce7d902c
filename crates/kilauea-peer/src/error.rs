use std::path::PathBuf;

/// Why something could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// The shared library cannot be opened or lacks a function.
    #[error("{}: {source}", path.display())]
    Library {
        /// The library.
        path: PathBuf,
        /// The loader's message.
        source: libloading::Error,
    },
    /// A call into Embree failed.
    #[error("Embree: {call} failed with RTCError {code}")]
    Embree {
        /// The C function.
        call: &'static str,
        /// Value of `RTCError`.
        code: i32,
    },
    /// The library is another major version, whose calls differ.
    #[error("{found} is not Embree {needed}")]
    Version {
        /// Name and version of the library.
        found: String,
        /// The major version that is needed.
        needed: isize,
    },
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{}: {fault}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// A triangle names a vertex that does not exist.
    #[error("{mesh}: triangle {triangle} has vertex {vertex} of {n_vertices}")]
    Index {
        /// Name of the mesh.
        mesh: String,
        /// Index of the triangle.
        triangle: usize,
        /// What it names.
        vertex: u32,
        /// How many there are.
        n_vertices: usize,
    },
    /// A mesh has nothing to hit.
    #[error("{mesh}: no triangles")]
    Empty {
        /// Name of the mesh.
        mesh: String,
    },
    /// A scene would take too much memory as one mesh.
    #[error("{mesh}: more than {limit} triangles with every instance baked")]
    TooManyTriangles {
        /// Name of the mesh.
        mesh: String,
        /// The limit given.
        limit: usize,
    },
    /// Threads for a build cannot be started.
    #[error("cannot start {n_threads} threads")]
    Threads {
        /// How many were asked for.
        n_threads: usize,
    },
}
