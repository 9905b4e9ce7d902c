//! Jobs that keep every output by the number of its root.

use std::sync::Mutex;

use kilauea_spot::{Job, Program};

/// So many roots, and their outputs.
pub(crate) struct Outputs<F, T> {
    n: u64,
    root: F,
    by_number: Mutex<Vec<Option<T>>>,
}

impl<F, T> Outputs<F, T> {
    /// `n` roots, each made from its number.
    pub(crate) fn new(n: usize, root: F) -> Self {
        Self {
            n: n as u64,
            root,
            by_number: Mutex::new((0..n).map(|_| None).collect()),
        }
    }

    /// Every output, in order. Panics if one is missing.
    pub(crate) fn into_vec(self) -> Vec<T> {
        let outputs = self.by_number.into_inner().expect("nobody panicked");
        let all: Option<Vec<T>> = outputs.into_iter().collect();
        all.expect("every root is done")
    }
}

impl<P, F> Job<P> for Outputs<F, P::Output>
where
    P: Program,
    F: Fn(u64) -> P::Work + Sync,
{
    fn root(&self, number: u64) -> Option<P::Work> {
        (number < self.n).then(|| (self.root)(number))
    }

    fn done(&self, number: u64, output: P::Output) {
        let mut outputs = self.by_number.lock().expect("nobody panicked");
        let before = outputs[number as usize].replace(output);
        assert!(before.is_none(), "root {number} is done once");
    }
}
