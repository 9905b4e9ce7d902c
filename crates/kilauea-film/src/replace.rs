use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use crate::ImageError;

/// Writes a file so that at every moment `path` is what it was before or complete: the bytes go
/// to `.<name>.<process id>.partial` beside it, are synced, and take the place of `path`. On an
/// error, or a panic in `write`, the partial file is removed.
pub(crate) fn write_replacing(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), ImageError>,
) -> Result<(), ImageError> {
    let io_error = |source| ImageError::Io {
        path: path.to_owned(),
        source,
    };

    let partial = Partial(partial_path(path).map_err(io_error)?);
    let mut writer = BufWriter::with_capacity(1 << 20, File::create(&partial.0).map_err(io_error)?);
    write(&mut writer)?;

    // Errors that the system reports late, like a full disk, show up here at the latest.
    let file = writer.into_inner().map_err(|e| io_error(e.into_error()))?;
    file.sync_all().map_err(io_error)?;
    drop(file);
    fs::rename(&partial.0, path).map_err(io_error)
}

fn partial_path(path: &Path) -> io::Result<PathBuf> {
    let name = path
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
    let mut partial = OsString::from(".");
    partial.push(name);
    partial.push(format!(".{}.partial", std::process::id()));
    Ok(path.with_file_name(partial))
}

/// Removes its file when dropped; after the rename there is none left.
struct Partial(PathBuf);

impl Drop for Partial {
    fn drop(&mut self) {
        // There is nothing to be done about a file that cannot be removed either.
        fs::remove_file(&self.0).ok();
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::io::Write;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// An empty directory of its own, removed when dropped.
    pub(crate) struct ScratchDir(pub(crate) PathBuf);

    impl ScratchDir {
        pub(crate) fn new() -> Self {
            static NEXT: AtomicU32 = AtomicU32::new(0);
            let n = NEXT.fetch_add(1, Ordering::Relaxed);
            let name = format!("kilauea-film-{}-{n}", std::process::id());
            let dir = std::env::temp_dir().join(name);
            fs::create_dir_all(&dir).unwrap();
            Self(dir)
        }

        pub(crate) fn names(&self) -> Vec<String> {
            let entries = fs::read_dir(&self.0).unwrap();
            entries
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .collect()
        }
    }

    impl Drop for ScratchDir {
        fn drop(&mut self) {
            fs::remove_dir_all(&self.0).ok();
        }
    }

    fn put(text: &'static str) -> impl FnOnce(&mut BufWriter<File>) -> Result<(), ImageError> {
        move |writer| {
            writer.write_all(text.as_bytes()).unwrap();
            Ok(())
        }
    }

    #[test]
    fn the_new_file_takes_the_place_of_the_old() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        write_replacing(&path, put("old and long")).unwrap();
        write_replacing(&path, put("new")).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(dir.names(), ["a.exr"]);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        write_replacing(&path, put("old")).unwrap();
        let result = write_replacing(&path, |writer| {
            writer.write_all(&vec![0; 3 << 20]).unwrap();
            Err(ImageError::Io {
                path: path.clone(),
                source: io::ErrorKind::StorageFull.into(),
            })
        });
        assert!(matches!(result, Err(ImageError::Io { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(dir.names(), ["a.exr"]);
    }

    #[test]
    fn a_directory_in_the_way_is_an_error() {
        let dir = ScratchDir::new();
        let path = dir.0.join("a.exr");
        fs::create_dir(&path).unwrap();
        let error = write_replacing(&path, put("new")).unwrap_err();
        assert!(error.to_string().contains("a.exr"), "{error}");
        assert_eq!(dir.names(), ["a.exr"]);
    }

    #[test]
    fn a_missing_directory_is_an_error() {
        let dir = ScratchDir::new();
        let path = dir.0.join("missing").join("a.exr");
        assert!(write_replacing(&path, put("new")).is_err());
        assert!(write_replacing(Path::new("/"), put("new")).is_err());
        assert_eq!(dir.names(), [""; 0]);
    }
}
