//! The same photons make the same map and the same answers, whoever works on them in what order.

use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{DensityRule, Irradiance, Photon, PhotonClass, PhotonMap, SurfaceQuery};
use kilauea_testing::uniforms;
use rayon::ThreadPoolBuilder;

use crate::photons::in_cube;

type Content = (Vec3, Spectrum, Vec3, Vec3, Option<u32>, PhotonClass);

fn content(map: &PhotonMap) -> Vec<Content> {
    (0..map.len())
        .map(|i| map.photon(i))
        .map(|p| (p.p(), p.power(), p.wi(), p.n(), p.light_idx(), p.class()))
        .collect()
}

fn queries() -> Vec<SurfaceQuery> {
    let query = |i| {
        let [x, y, z] = uniforms(5, i);
        SurfaceQuery {
            p: Vec3::new(x, y, z),
            n: Vec3::Z,
        }
    };
    (0..700).map(query).collect()
}

fn answers(map: &PhotonMap) -> Vec<Irradiance> {
    map.irradiances(&queries(), 0.2, &DensityRule::default())
}

#[test]
fn any_number_of_threads() {
    let photons = in_cube(20_000);
    let by_threads = [1, 2, 7].map(|n_threads| {
        let pool = ThreadPoolBuilder::new().num_threads(n_threads).build();
        pool.expect("threads").install(|| {
            let map = PhotonMap::build(&photons);
            (content(&map), answers(&map))
        })
    });
    assert!(by_threads[0].1.iter().any(|found| found.n_photons > 0));
    assert_eq!(by_threads[0], by_threads[1]);
    assert_eq!(by_threads[0], by_threads[2]);
}

#[test]
fn any_order_of_the_photons() {
    let photons = in_cube(3000);
    let reversed: Vec<Photon> = photons.iter().rev().copied().collect();
    let [a, b] = [photons, reversed].map(|photons| content(&PhotonMap::build(&photons)));
    assert_eq!(a, b);
}

#[test]
fn any_batch_of_queries() {
    let map = PhotonMap::build(&in_cube(5000));
    let rule = DensityRule::default();
    let alone: Vec<Irradiance> = queries()
        .iter()
        .map(|query| map.irradiance(query, 0.2, &rule))
        .collect();
    assert_eq!(alone, answers(&map));
}
