//! A small run of `examples/truth` for every day.

#[path = "../examples/truth/suite/mod.rs"]
mod suite;

#[test]
fn no_set_has_a_wrong_hit() {
    const RAYS_PER_SET: u64 = 8000;
    for set in suite::all_sets() {
        let tally = suite::run(&set, RAYS_PER_SET);
        assert!(
            tally.n_spawned > RAYS_PER_SET / 10,
            "{}: few hits",
            set.name
        );
        assert!(tally.is_clean(), "{}: {:#?}", set.name, tally.failures);
    }
}
