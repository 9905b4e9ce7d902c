//! Meshes and rays as files; `docs/file-formats.md` describes them.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use crate::{PeerError, Query, RaySet, Segment, TriangleMesh, Workload};

const MESH_MAGIC: [u8; 8] = *b"KLMESH\0\0";
const RAYS_MAGIC: [u8; 8] = *b"KLRAYS\0\0";
const VERSION: u32 = 1;

impl Workload {
    /// Reads a mesh file, and ray files whose names become the kinds of their rays.
    pub fn read(mesh: &Path, rays: &[PathBuf]) -> Result<Self, PeerError> {
        let name = stem(mesh);
        let sets = rays.iter().map(|path| {
            let kind = stem(path);
            // Files that `dump` wrote begin with the name of the mesh.
            let kind = kind.strip_prefix(&format!("{name}.")).unwrap_or(&kind);
            read_rays(path, kind)
        });
        Ok(Self {
            rays: sets.collect::<Result<_, _>>()?,
            mesh: read_mesh(mesh, &name)?,
            name,
        })
    }

    /// Writes `NAME.mesh` and a file `NAME.KIND.rays` for each set of rays into a folder.
    pub fn dump(&self, folder: &Path) -> Result<(), PeerError> {
        write_mesh(&folder.join(format!("{}.mesh", self.name)), &self.mesh)?;
        for set in &self.rays {
            let path = folder.join(format!("{}.{}.rays", self.name, set.kind));
            write_rays(&path, set)?;
        }
        Ok(())
    }
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(OsStr::new("unnamed"));
    stem.to_string_lossy().into_owned()
}

fn write_mesh(path: &Path, mesh: &TriangleMesh) -> Result<(), PeerError> {
    let (positions, triangles) = (mesh.positions(), mesh.triangles());
    let mut bytes = Vec::with_capacity(32 + 12 * (positions.len() + triangles.len()));
    bytes.extend(MESH_MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend((positions.len() as u64).to_le_bytes());
    bytes.extend((triangles.len() as u64).to_le_bytes());
    bytes.extend(positions.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes.extend(triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
    write(path, &bytes)
}

fn read_mesh(path: &Path, name: &str) -> Result<TriangleMesh, PeerError> {
    let bytes = read(path)?;
    let mut file = Reader::new(path, &bytes, MESH_MAGIC)?;
    file.u32()?;
    let (n_vertices, n_triangles) = (file.count()?, file.count()?);
    let positions = file.array(n_vertices, |c: [[u8; 4]; 3]| c.map(f32::from_le_bytes))?;
    let triangles = file.array(n_triangles, |c: [[u8; 4]; 3]| c.map(u32::from_le_bytes))?;
    file.end()?;
    TriangleMesh::new(name, positions, triangles)
}

fn write_rays(path: &Path, set: &RaySet) -> Result<(), PeerError> {
    let mut bytes = Vec::with_capacity(24 + 32 * set.rays.len());
    bytes.extend(RAYS_MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    let query = match set.query {
        Query::Nearest => 0_u32,
        Query::Any => 1,
        Query::NearestCoherent => 2,
    };
    bytes.extend(query.to_le_bytes());
    bytes.extend((set.rays.len() as u64).to_le_bytes());
    for ray in &set.rays {
        let [ox, oy, oz] = ray.origin;
        let [dx, dy, dz] = ray.dir;
        let floats = [ox, oy, oz, ray.t_min, dx, dy, dz, ray.t_max];
        bytes.extend(floats.into_iter().flat_map(f32::to_le_bytes));
    }
    write(path, &bytes)
}

fn read_rays(path: &Path, kind: &str) -> Result<RaySet, PeerError> {
    let bytes = read(path)?;
    let mut file = Reader::new(path, &bytes, RAYS_MAGIC)?;
    let query = match file.u32()? {
        0 => Query::Nearest,
        1 => Query::Any,
        2 => Query::NearestCoherent,
        other => return Err(file.fault(format!("query {other} is none of 0, 1 and 2"))),
    };
    let n_rays = file.count()?;
    let rays = file.array(n_rays, |ray: [[u8; 4]; 8]| {
        let [ox, oy, oz, t_min, dx, dy, dz, t_max] = ray.map(f32::from_le_bytes);
        Segment {
            origin: [ox, oy, oz],
            t_min,
            dir: [dx, dy, dz],
            t_max,
        }
    })?;
    file.end()?;
    if let Some(at) = rays.iter().position(|ray| !ray.is_valid()) {
        return Err(file.fault(format!("ray {at} is not valid")));
    }
    if rays.is_empty() {
        return Err(file.fault("no rays".into()));
    }
    Ok(RaySet {
        kind: kind.into(),
        query,
        rays,
    })
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), PeerError> {
    fs::write(path, bytes).map_err(|source| PeerError::Io {
        path: path.into(),
        source,
    })
}

fn read(path: &Path) -> Result<Vec<u8>, PeerError> {
    fs::read(path).map_err(|source| PeerError::Io {
        path: path.into(),
        source,
    })
}

/// Takes a file apart from its beginning on.
struct Reader<'a> {
    path: &'a Path,
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Reads past magic and version.
    fn new(path: &'a Path, bytes: &'a [u8], magic: [u8; 8]) -> Result<Self, PeerError> {
        let mut reader = Self { path, rest: bytes };
        if reader.bytes()? != magic {
            let name = String::from_utf8_lossy(&magic[..6]).into_owned();
            return Err(reader.fault(format!("does not begin with {name}")));
        }
        match reader.u32()? {
            VERSION => Ok(reader),
            other => Err(reader.fault(format!("version {other} is not {VERSION}"))),
        }
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], PeerError> {
        let (&first, rest) =
            (self.rest.split_first_chunk()).ok_or_else(|| self.fault("ends too early".into()))?;
        self.rest = rest;
        Ok(first)
    }

    fn u32(&mut self) -> Result<u32, PeerError> {
        self.bytes().map(u32::from_le_bytes)
    }

    fn count(&mut self) -> Result<usize, PeerError> {
        let count = self.bytes().map(u64::from_le_bytes)?;
        usize::try_from(count).map_err(|_| self.fault(format!("{count} elements")))
    }

    /// `count` elements of `N` numbers of four bytes.
    fn array<const N: usize, T>(
        &mut self,
        count: usize,
        element: impl Fn([[u8; 4]; N]) -> T,
    ) -> Result<Vec<T>, PeerError> {
        let n_bytes = count.saturating_mul(4 * N);
        let (taken, rest) = (self.rest.split_at_checked(n_bytes))
            .ok_or_else(|| self.fault(format!("ends before {count} elements")))?;
        self.rest = rest;
        let (numbers, _) = taken.as_chunks::<4>();
        let (elements, _) = numbers.as_chunks::<N>();
        Ok(elements.iter().map(|&numbers| element(numbers)).collect())
    }

    fn end(&self) -> Result<(), PeerError> {
        match self.rest.len() {
            0 => Ok(()),
            n => Err(self.fault(format!("{n} bytes too many"))),
        }
    }

    fn fault(&self, fault: String) -> PeerError {
        PeerError::Format {
            path: self.path.into(),
            fault,
        }
    }
}
