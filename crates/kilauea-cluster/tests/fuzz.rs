//! A few thousand damaged inputs for each decoder; `examples/fuzz.rs` goes on for hours.

mod fuzzing;

use fuzzing::{Fuzzer, targets};

#[test]
fn damaged_bytes_never_panic_nor_take_more_memory_than_they_may() {
    for target in targets() {
        let mut fuzzer = Fuzzer::new(target, 1);
        fuzzer.run(4000);
        let (name, findings) = (fuzzer.target.name, &fuzzer.findings);
        let fault = findings.faults.first();
        assert!(fault.is_none(), "{name}: {fault:?}");
        // Some get through, and others do not.
        assert!(findings.n_read > 0, "{name}: {findings:?}");
        assert!(findings.n_outcomes > 1, "{name}: {findings:?}");
    }
}

#[test]
fn seeds_are_read() {
    for mut target in targets() {
        for seed in target.seeds.clone() {
            assert_eq!((target.read)(&seed), Ok(()), "{}", target.name);
            let repaired = (target.repair)(seed.clone());
            assert_eq!(repaired.len(), seed.len(), "{}", target.name);
        }
    }
}
