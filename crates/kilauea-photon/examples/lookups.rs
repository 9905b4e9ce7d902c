//! What photon maps cost: photons a second into a map, look-ups a second out of it, bytes.
//!
//! ```sh
//! cargo run --release -p kilauea-photon --example lookups -- 100000 1000000 10000000
//! ```
//!
//! Photons lie on the walls of a room and on spheres in it, half of them evenly and half in patches
//! as caustics are. Look-ups are at other points of the same kind, in no order unless said. All is
//! done by one thread, and what counts is its processor time, since machines have other work.
#![allow(clippy::print_stdout, reason = "a command prints its results")]

use std::f32::consts::PI;
use std::hint::black_box;
use std::num::NonZeroUsize;

use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Frame, Spectrum, Vec2, Vec3, warp};
use kilauea_photon::{
    DensityRule, Photon, PhotonClass, PhotonMap, RadianceCache, RadiusRule, SurfaceQuery,
};

/// Photons that a look-up finds in the mean, or is asked for.
const N_FOUND: usize = 50;
const N_QUERIES: u32 = 20_000;
const N_ROUNDS: usize = 7;

fn main() {
    let sizes: Vec<u32> = std::env::args()
        .skip(1)
        .map(|size| size.parse().expect("a number of photons"))
        .collect();
    println!(
        "photons | build Mphotons/s | bytes a photon | within k/s | within, sorted k/s | nearest k/s | radiance k/s | records | within found"
    );
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    one_thread.expect("a thread").install(|| {
        for n_photons in sizes {
            report(n_photons);
        }
    });
}

fn report(n_photons: u32) {
    let photons: Vec<Photon> = (0..n_photons).map(|i| photon(1, i)).collect();
    let build_secs = best_secs(3, || PhotonMap::build(&photons));
    let map = PhotonMap::build(&photons);
    drop(photons);

    let queries: Vec<SurfaceQuery> = (0..N_QUERIES)
        .map(|i| photon(2, i))
        .map(|Photon { p, n, .. }| SurfaceQuery { p, n })
        .collect();
    let rule = DensityRule::default();
    let k = NonZeroUsize::new(N_FOUND).expect("not zero");
    let radius = radius_that_finds(&map, &queries);
    let thousands_per_sec = |run: &dyn Fn()| f64::from(N_QUERIES) / 1e3 / best_secs(N_ROUNDS, run);

    let within = thousands_per_sec(&|| {
        for query in &queries {
            black_box(map.irradiance(query, radius, &rule));
        }
    });
    let within_sorted = thousands_per_sec(&|| {
        black_box(map.irradiances(&queries, radius, &rule));
    });
    let nearest = thousands_per_sec(&|| {
        for query in &queries {
            black_box(map.irradiance_by_nearest(query, k, 1.0, &rule));
        }
    });
    let every = NonZeroUsize::new(4).expect("not zero");
    let cache = RadianceCache::build(&map, every, RadiusRule::Fixed(radius), &rule);
    let radiance = thousands_per_sec(&|| {
        for query in &queries {
            black_box(cache.lookup(query, radius));
        }
    });
    let n_found: u32 = map
        .irradiances(&queries, radius, &rule)
        .iter()
        .map(|found| found.n_photons)
        .sum();
    println!(
        "{n_photons} | {:.2} | {:.1} | {within:.0} | {within_sorted:.0} | {nearest:.0} | {radiance:.0} | {} | {:.1}",
        f64::from(n_photons) / 1e6 / build_secs,
        map.bytes() as f64 / f64::from(n_photons),
        cache.len(),
        f64::from(n_found) / f64::from(N_QUERIES),
    );
}

/// The radius within which queries find `N_FOUND` photons in the median.
fn radius_that_finds(map: &PhotonMap, queries: &[SurfaceQuery]) -> f32 {
    let k = NonZeroUsize::new(N_FOUND).expect("not zero");
    let reach = |query: &SurfaceQuery| map.nearest(query.p, k, 10.0).last().map_or(0.0, |f| f.d_sq);
    let mut reaches_sq: Vec<f32> = queries.iter().take(1000).map(reach).collect();
    reaches_sq.sort_by(f32::total_cmp);
    reaches_sq[reaches_sq.len() / 2].sqrt()
}

/// The least processor time of several runs.
fn best_secs<R>(n_rounds: usize, run: impl Fn() -> R) -> f64 {
    let secs = |_| {
        let start = thread_secs();
        black_box(run());
        thread_secs() - start
    };
    (0..n_rounds).map(secs).fold(f64::INFINITY, f64::min)
}

/// Processor time of this thread so far, as Linux counts it.
fn thread_secs() -> f64 {
    let counts = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let nanoseconds: f64 = counts
        .split(' ')
        .next()
        .and_then(|count| count.parse().ok())
        .expect("a count of nanoseconds");
    1e-9 * nanoseconds
}

/// Photon `i` of a stream.
fn photon(stream: u32, i: u32) -> Photon {
    let key = combine(stream, i);
    let random = |dimension: u32| unit_f32(combine(key, dimension));
    let surface = random(0);
    let mut uv = Vec2::new(random(1), random(2));
    if random(3) < 0.5 {
        // In one of 64 patches, each a hundredth of the surface wide.
        let patch = (random(4) * 64.0) as u32;
        let center = Vec2::new(unit_f32(combine(77, patch)), unit_f32(combine(78, patch)));
        uv = (center + (uv - 0.5) * 0.01).clamp(Vec2::ZERO, Vec2::ONE);
    }
    let (p, n) = if surface < 0.7 {
        on_wall((surface / 0.7 * 6.0) as u32, uv)
    } else {
        on_sphere((random(5) * 40.0) as u32, uv)
    };
    let wi = Frame::from_z(n).from_local(warp::cosine_hemisphere(Vec2::new(random(6), random(7))));
    Photon {
        p,
        power: Spectrum::new(1.0, random(8), random(9)),
        wi,
        n,
        light_idx: i % 10,
        class: PhotonClass::Global,
        path_idx: i,
        depth: 0,
    }
}

/// A point of a wall of the room of 8 m by 3 m by 6 m, and the normal inward.
fn on_wall(wall: u32, uv: Vec2) -> (Vec3, Vec3) {
    let axis = (wall % 3) as usize;
    let is_far = wall >= 3;
    let mut unit = Vec3::ZERO;
    unit[axis] = f32::from(u8::from(is_far));
    unit[(axis + 1) % 3] = uv.x;
    unit[(axis + 2) % 3] = uv.y;
    let mut n = Vec3::ZERO;
    n[axis] = if is_far { -1.0 } else { 1.0 };
    (unit * Vec3::new(8.0, 3.0, 6.0), n)
}

/// A point of one of the spheres in the room.
fn on_sphere(sphere: u32, uv: Vec2) -> (Vec3, Vec3) {
    let place = |dimension: u32| unit_f32(combine(combine(79, sphere), dimension));
    let center = Vec3::new(place(0), place(1), place(2)) * Vec3::new(8.0, 3.0, 6.0);
    let radius = 0.1 + 0.4 * place(3);
    let (phi, z) = (2.0 * PI * uv.x, 1.0 - 2.0 * uv.y);
    let r = (1.0 - z * z).max(0.0).sqrt();
    let n = Vec3::new(r * phi.cos(), r * phi.sin(), z);
    (center + radius * n, n)
}
