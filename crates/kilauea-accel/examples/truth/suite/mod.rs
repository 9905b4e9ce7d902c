//! Rays whose hits are known, traced by every kernel.

mod oracle;
mod rays;
mod sets;
#[path = "../../../tests/shapes/mod.rs"]
mod shapes;
mod spawned;
mod stage;
mod tally;

pub(crate) use sets::{Set, all_sets};
pub(crate) use tally::Tally;

use kilauea_accel::{Hit, Ray};
use oracle::Oracle;
use rays::{Aimed, RaySource};
use shapes::Builds;
use spawned::leave;
use stage::Stage;

/// Traces about `n_rays` over the stages of a set, those that leave its surfaces included.
pub(crate) fn run(set: &Set, n_rays: u64) -> Tally {
    let n_stages = set.stages.len() as u64;
    let mut tally = Tally::default();
    for (index, stage) in set.stages.iter().enumerate() {
        let until = n_rays * (index as u64 + 1) / n_stages;
        run_stage(stage, index as u64, until, &mut tally);
    }
    tally
}

fn run_stage(stage: &Stage, seed: u64, until: u64, tally: &mut Tally) {
    let builds = Builds::new(&stage.geometries(), &stage.placements);
    let oracle = Oracle::new(stage);
    let mut source = RaySource::new(stage, seed);
    while tally.n_rays < until {
        let aimed = source.next();
        let Some(hit) = check(&builds, &oracle, &aimed, tally) else {
            continue;
        };
        let left = leave(stage, &oracle, &hit, source.random());
        tally.n_spawned += 1;
        let again = check(&builds, &oracle, &left, tally);
        let told = Ray {
            from: hit.id(),
            ..left.ray
        };
        let agree = builds.0.iter().all(|accel| {
            accel.intersect(&told) == again && accel.occluded(&told) == again.is_some()
        });
        tally.kernels_differ(&told, again, !agree);
        let is_same = again.is_some_and(|again| {
            again.instance == hit.instance
                && oracle.is_same_place(hit.instance, hit.primitive, again.primitive)
        });
        tally.self_hit(&left.ray, again, is_same);
    }
}

/// Traces a ray by all builds and judges what they find.
fn check(builds: &Builds, oracle: &Oracle, aimed: &Aimed, tally: &mut Tally) -> Option<Hit> {
    let ray = &aimed.ray;
    let nearest = oracle.nearest(ray);
    // The portable kernel, then AVX2 with and without special walks.
    let found = builds.0[0].intersect(ray);
    let agree = builds
        .0
        .iter()
        .all(|accel| accel.intersect(ray) == found && accel.occluded(ray) == found.is_some());
    tally.kernels_differ(ray, found, !agree);
    tally.judge(oracle, aimed, nearest, found);
    tally.n_rays += 1;
    found
}
