//! What an answer brings of a primitive that lies elsewhere, on its way to the path that asked.

use std::sync::Arc;

use kilauea_spot::{Wire, WireError};

use super::carried_wire::skip_carried;
use crate::geometry::Carried;

/// A [`Carried`], or where it is in the answers to a batch.
///
/// Answers of other processes are read where a path goes on from them, each by itself. So its memory is
/// taken and given back by the thread that has the path, what it holds is in that thread's caches, and
/// of hits that lose against another nothing is read.
#[derive(Clone, Debug)]
pub(crate) enum Parcel {
    Open(Box<Carried>),
    Sealed(Sealed),
}

/// A place in answers at which there is a primitive, as was checked.
#[derive(Clone, Debug)]
pub(crate) struct Sealed {
    answers: Arc<Vec<u8>>,
    begin: u32,
}

impl Sealed {
    /// What begins there, and where it ends.
    pub(super) fn at(answers: &Arc<Vec<u8>>, begin: usize) -> Result<(Self, usize), WireError> {
        let mut rest = answers.get(begin..).ok_or(WireError::Short)?;
        skip_carried(&mut rest)?;
        let sealed = Self {
            answers: Arc::clone(answers),
            begin: begin as u32,
        };
        Ok((sealed, answers.len() - rest.len()))
    }
}

impl Parcel {
    /// What is in it.
    pub(crate) fn open(self) -> Box<Carried> {
        match self {
            Self::Open(carried) => carried,
            Self::Sealed(Sealed { answers, begin }) => {
                let carried = Carried::decode(&mut &answers[begin as usize..]);
                Box::new(carried.expect("it was read through when it came"))
            }
        }
    }

    /// Appends what is in it.
    pub(crate) fn encode(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Open(carried) => carried.encode(bytes),
            Self::Sealed(_) => self.clone().open().encode(bytes),
        }
    }
}

/// By what is in them.
impl PartialEq for Parcel {
    fn eq(&self, other: &Self) -> bool {
        self.clone().open() == other.clone().open()
    }
}
