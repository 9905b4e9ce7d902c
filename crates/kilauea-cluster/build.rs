//! Hashes the sources and how they are compiled, so that two programs know whether they give the
//! same pixels. FNV-1a: it tells builds apart and guards nothing.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Folders whose Rust sources decide what pixels are, from the root of the repository.
const FOLDERS: [&str; 2] = ["crates", "shaders"];
/// What lies in them and does not.
const OTHERS: [&str; 2] = ["tests", "examples"];

fn main() {
    let manifest = env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    let root = Path::new(&manifest).join("../..");
    let mut files = vec![root.join("Cargo.lock"), root.join("Cargo.toml")];
    for folder in FOLDERS {
        println!("cargo::rerun-if-changed={}", root.join(folder).display());
        add_sources(&root.join(folder), &mut files);
    }
    files.sort();
    let mut hash = 0xcbf2_9ce4_8422_2325;
    for file in files {
        let name = file.strip_prefix(&root).unwrap_or(&file);
        add(&mut hash, name.to_string_lossy().as_bytes());
        add(&mut hash, &fs::read(&file).unwrap_or_default());
    }
    for name in ["TARGET", "OPT_LEVEL", "DEBUG", "CARGO_CFG_TARGET_FEATURE"] {
        add(&mut hash, env::var(name).unwrap_or_default().as_bytes());
    }
    println!("cargo::rustc-env=KILAUEA_BUILD_HASH={hash:016x}");
}

fn add_sources(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let is_other = OTHERS.iter().any(|other| path.ends_with(other));
        if path.is_dir() && !is_other {
            add_sources(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

fn add(hash: &mut u64, bytes: &[u8]) {
    for &byte in bytes {
        *hash = (*hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
}
