//! Jobs that keep every output by the number of its root.

use std::sync::Mutex;

use kilauea_spot::{Job, Program};

/// So many roots, and their outputs.
pub(crate) struct Outputs<F, T> {
    root: F,
    outputs: Mutex<Vec<Option<T>>>,
}

impl<F, T> Outputs<F, T> {
    /// `n` roots, each made from its number.
    pub(crate) fn new(n: usize, root: F) -> Self {
        let outputs = Mutex::new((0..n).map(|_| None).collect());
        Self { root, outputs }
    }

    /// Every output, in order. Panics if one is missing.
    pub(crate) fn into_vec(self) -> Vec<T> {
        let outputs = self.outputs.into_inner().unwrap();
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
        let n = self.outputs.lock().unwrap().len() as u64;
        (number < n).then(|| (self.root)(number))
    }

    fn done(&self, number: u64, output: P::Output) {
        let before = self.outputs.lock().unwrap()[number as usize].replace(output);
        assert!(before.is_none(), "root {number} is done once");
    }
}
