//! Feeds damaged bytes to everything that reads bytes of others: no panic, no more memory than the
//! bytes may ask for. Inputs that end in a way not seen before are damaged further.

mod mutate;
mod seeds;
mod targets;

use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use mutate::Mutator;
use peak_alloc::PeakAlloc;
pub(crate) use targets::{Target, targets};

/// Outcomes, and inputs that had one first, that are kept of a target.
const MAX_KEPT: usize = 512;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What came of the damaged inputs of a target.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    pub(crate) n_inputs: u64,
    /// Inputs that were read without an error.
    pub(crate) n_read: u64,
    /// Ways to end: that of success, and errors that differ in more than numbers and names.
    pub(crate) n_outcomes: usize,
    /// Most bytes allocated for an input.
    pub(crate) peak_bytes: usize,
    /// Inputs that made it panic, or allocate more than it may, and which of the two.
    pub(crate) faults: Vec<(String, Vec<u8>)>,
}

/// A target with the inputs that are worth damaging.
pub(crate) struct Fuzzer {
    pub(crate) target: Target,
    corpus: Vec<Vec<u8>>,
    outcomes: HashSet<String>,
    mutator: Mutator,
    pub(crate) findings: Findings,
}

impl Fuzzer {
    pub(crate) fn new(target: Target, seed: u64) -> Self {
        Self {
            corpus: target.seeds.clone(),
            outcomes: HashSet::new(),
            mutator: Mutator::new(seed),
            findings: Findings::default(),
            target,
        }
    }

    /// Tries damaged inputs.
    pub(crate) fn run(&mut self, n_inputs: u64) {
        for _ in 0..n_inputs {
            // Half of them from inputs that are whole.
            let n_first = match self.mutator.below(2) {
                0 => self.target.seeds.len(),
                _ => self.corpus.len(),
            };
            let at = self.mutator.below(n_first);
            let other = self.mutator.below(self.corpus.len());
            let damaged = self.mutator.damage(&self.corpus[at], &self.corpus[other]);
            // Half of them with checksums and lengths that fit, to get behind what checks those.
            let input = if self.mutator.below(2) == 0 {
                (self.target.repair)(damaged)
            } else {
                damaged
            };
            self.feed(input);
        }
    }

    fn feed(&mut self, input: Vec<u8>) {
        let findings = &mut self.findings;
        findings.n_inputs += 1;
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let read = catch_unwind(AssertUnwindSafe(|| (self.target.read)(&input)));
        let n_bytes = MEMORY.peak_usage().saturating_sub(before);
        findings.peak_bytes = findings.peak_bytes.max(n_bytes);
        let limit = self.target.fixed_bytes + self.target.bytes_per_byte * input.len();
        if n_bytes > limit {
            let fault = format!("{n_bytes} bytes allocated, over {limit}");
            findings.faults.push((fault, input));
            return;
        }
        let outcome = match read {
            Ok(Ok(())) => {
                findings.n_read += 1;
                "read".to_owned()
            }
            Ok(Err(error)) => gist(&error),
            Err(_) => {
                findings.faults.push(("panic".into(), input));
                return;
            }
        };
        let is_new = self.outcomes.len() < MAX_KEPT && self.outcomes.insert(outcome);
        if is_new {
            self.corpus.push(input);
        }
        findings.n_outcomes = self.outcomes.len();
    }
}

/// An error without what it quotes of its input: its first words of small letters.
fn gist(error: &str) -> String {
    let is_word = |word: &&str| word.chars().all(|c| c.is_ascii_lowercase());
    let words: Vec<&str> = error.split(' ').filter(is_word).take(8).collect();
    words.join(" ")
}
