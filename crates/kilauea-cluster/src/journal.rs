//! The results of a frame on disk, as they come: what a console that died had is not rendered again.
//!
//! A file of frames as they go over links: a [`Manifest`], then [`UnitDone`]s in the order in which
//! they counted. Frames that were not written to their end are cut off.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::protocol::{
    Expected, Frame, FrameError, HEADER_BYTES, Header, MAGIC, Manifest, Message, UnitDone,
};

/// Frames of journals have no session of their own.
const SESSION: u64 = 0;
/// What may be lost where the machine dies; nothing is where only the process does.
const SYNC_EVERY: Duration = Duration::from_secs(5);

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The file cannot be read or written.
    #[error("{path}: {error}")]
    Io {
        /// The file.
        path: String,
        /// What went wrong.
        error: io::Error,
    },
    /// It is of something else.
    #[error("{path} is the journal of another {what}: remove it to begin again")]
    Other {
        /// The file.
        path: String,
        /// What is not the same.
        what: &'static str,
    },
    /// It cannot be a journal.
    #[error("{path} is no journal: {error}")]
    Broken {
        /// The file.
        path: String,
        /// What is wrong.
        error: FrameError,
    },
}

/// A journal that results are added to.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    number: u16,
    last_sync: Instant,
}

impl Journal {
    /// Opens the journal of a frame or begins it. Gives the results that it has to `restore`, in their
    /// order, up to the first that `restore` does not take.
    pub(crate) fn open(
        path: &Path,
        manifest: &Manifest,
        mut restore: impl FnMut(&Frame) -> bool,
    ) -> Result<Self, JournalError> {
        let fail = |error| JournalError::Io {
            path: path.display().to_string(),
            error,
        };
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(path).map_err(fail)?;
        let broken = |error| JournalError::Broken {
            path: path.display().to_string(),
            error,
        };
        if !begins_like_one(&mut file).map_err(fail)? {
            return Err(broken(FrameError::Magic));
        }
        let mut frames = FrameFile::new(&mut file);
        let mut n_kept_bytes = 0;
        let mut number = 0;
        if let Some(first) = frames.next().map_err(broken)? {
            let other = |what| JournalError::Other {
                path: path.display().to_string(),
                what,
            };
            let (theirs, _) = Manifest::read(&first).map_err(broken)?;
            check_manifest(&theirs, manifest).map_err(other)?;
            n_kept_bytes = frames.n_bytes;
            number = 1;
            // A torn tail ends what there is.
            while let Ok(Some(frame)) = frames.next() {
                if UnitDone::read(&frame).is_err() || !restore(&frame) {
                    break;
                }
                n_kept_bytes = frames.n_bytes;
                number = frames.number;
            }
        }
        file.set_len(n_kept_bytes).map_err(fail)?;
        file.seek(SeekFrom::End(0)).map_err(fail)?;
        let mut journal = Self {
            path: path.to_owned(),
            file,
            number,
            last_sync: Instant::now(),
        };
        if n_kept_bytes == 0 {
            journal.add(&manifest.frame(0, &[]))?;
        }
        Ok(journal)
    }

    /// Adds the frame of a result.
    pub(crate) fn add(&mut self, frame: &Frame) -> Result<(), JournalError> {
        let written = self.write(frame);
        written.map_err(|error| self.failed(error))?;
        self.sync_now_and_then()
    }

    /// Makes sure that what was added survives the machine, where that was last done long ago.
    pub(crate) fn sync_now_and_then(&mut self) -> Result<(), JournalError> {
        if self.last_sync.elapsed() < SYNC_EVERY {
            return Ok(());
        }
        self.last_sync = Instant::now();
        self.file.sync_data().map_err(|error| self.failed(error))
    }

    /// Removes the file.
    pub fn remove(self) -> Result<(), JournalError> {
        std::fs::remove_file(&self.path).map_err(|error| self.failed(error))
    }

    fn write(&mut self, frame: &Frame) -> io::Result<()> {
        let header = frame.header(SESSION, self.number);
        self.number = self.number.wrapping_add(1);
        let header = header.map_err(io::Error::other)?;
        self.file.write_all(&[&header[..], &frame.body].concat())
    }

    fn failed(&self, error: io::Error) -> JournalError {
        JournalError::Io {
            path: self.path.display().to_string(),
            error,
        }
    }
}

/// Whether a file may be a journal, or the beginning of one: anything else is not to be overwritten.
fn begins_like_one(file: &mut File) -> io::Result<bool> {
    let mut begin = Vec::new();
    Read::by_ref(file)
        .take(MAGIC.len() as u64)
        .read_to_end(&mut begin)?;
    file.rewind()?;
    Ok(MAGIC.starts_with(&begin))
}

/// What is not the same, in a word.
fn check_manifest(theirs: &Manifest, ours: &Manifest) -> Result<(), &'static str> {
    if theirs.build_hash != ours.build_hash {
        return Err("build of Kilauea");
    }
    if theirs.scene_hash != ours.scene_hash {
        return Err("scene");
    }
    if theirs.settings_hash != ours.settings_hash {
        return Err("set of settings");
    }
    Ok(())
}

/// Reads frames.
struct FrameFile<'a> {
    file: io::BufReader<&'a mut File>,
    number: u16,
    /// Bytes of all frames so far.
    n_bytes: u64,
}

impl<'a> FrameFile<'a> {
    fn new(file: &'a mut File) -> Self {
        Self {
            file: io::BufReader::new(file),
            number: 0,
            n_bytes: 0,
        }
    }

    /// The next frame; none at the end, also where that is within a frame.
    fn next(&mut self) -> Result<Option<Frame>, FrameError> {
        match self.read() {
            Err(FrameError::Io(error)) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            read => read.map(Some),
        }
    }

    fn read(&mut self) -> Result<Frame, FrameError> {
        let mut header = [0; HEADER_BYTES];
        self.file.read_exact(&mut header)?;
        let expected = Expected {
            session: Some(SESSION),
            number: self.number,
            max_body_bytes: u32::MAX,
        };
        let header = Header::parse(&header, &expected)?;
        let mut body = vec![0; header.n_body_bytes()];
        self.file.read_exact(&mut body)?;
        self.number = self.number.wrapping_add(1);
        self.n_bytes += (HEADER_BYTES + body.len()) as u64;
        header.with_body(body)
    }
}
