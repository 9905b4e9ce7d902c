//! Meshes and rays survive their files, and files that are something else are refused.

use kilauea_peer::{Shape, Workload, shape};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder that goes away with its test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("kilauea-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for the test");
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn what_is_dumped_is_read_again() {
    let folder = Folder::new("dump");
    let written = shape(Shape::Room, 100).expect("a valid shape");
    written.dump(&folder.0).expect("a folder to write to");
    let rays: Vec<PathBuf> = written
        .rays
        .iter()
        .map(|set| folder.path(&format!("room.{}.rays", set.kind)))
        .collect();
    let read = Workload::read(&folder.path("room.mesh"), &rays).expect("valid files");
    assert_eq!(read.name, "room");
    assert_eq!(read.mesh.positions(), written.mesh.positions());
    assert_eq!(read.mesh.triangles(), written.mesh.triangles());
    assert_eq!(read.rays, written.rays);
}

#[test]
fn damaged_files_are_refused() {
    let folder = Folder::new("damaged");
    let mesh = folder.path("room.mesh");
    let rays = folder.path("room.primary.rays");
    let check = |damaged: &Path, change: &dyn Fn(&mut Vec<u8>), expected: &str| {
        shape(Shape::Room, 100)
            .and_then(|workload| workload.dump(&folder.0))
            .expect("files to damage");
        let mut bytes = fs::read(damaged).expect("just written");
        change(&mut bytes);
        fs::write(damaged, bytes).expect("can be written");
        let error = Workload::read(&mesh, std::slice::from_ref(&rays)).expect_err(expected);
        let text = error.to_string();
        assert!(text.contains(expected), "{text:?} is not {expected:?}");
    };
    check(&mesh, &|b| b[0] = b'X', "does not begin with KLMESH");
    check(&mesh, &|b| b[8] = 2, "version 2 is not 1");
    check(&mesh, &|b| b.truncate(20), "ends too early");
    check(&mesh, &|b| b.truncate(100), "ends before 32 elements");
    check(&mesh, &|b| b[16..24].fill(0xff), "ends before");
    check(&mesh, &|b| b.push(0), "1 bytes too many");
    let last_index = |b: &mut Vec<u8>| {
        let at = b.len() - 4;
        b[at..].fill(0xff);
    };
    check(
        &mesh,
        &last_index,
        "triangle 31 has vertex 4294967295 of 32",
    );
    check(&rays, &|b| b[12] = 7, "query 7 is none of 0, 1 and 2");
    check(&rays, &|b| b[24..28].fill(0xff), "ray 0 is not valid");
    check(&rays, &|b| b[..8].copy_from_slice(b"KLMESH\0\0"), "KLRAYS");
}
