//! Aimed light is the same light, and more of its photons go where they were aimed.

use kilauea_accel::Ray;
use kilauea_math::{Vec2, Vec3};
use kilauea_testing::{Family, Moments, project, uniforms, welch_p};

use super::cases::{Case, cases, emitter};
use crate::light::{EmittedPhoton, Emitter, UsefulRay};

const N_DRAWS: u32 = 12_000;

fn emit(emitter: &Emitter<'_>, stream: u32, i: u32) -> Option<EmittedPhoton> {
    let [a, b, c, d, e, f] = uniforms(stream, i);
    emitter.emit(Vec2::new(a, b), Vec2::new(c, d), Vec2::new(e, f))
}

/// Whether a ray is much like the first that a light sends out: in its direction, or of light from
/// infinity in its place.
fn is_near(case: &Case, ray: &Ray, first: &Ray) -> bool {
    if case.is_small() {
        ray.dir.dot(first.dir) > 0.9
    } else {
        p_nearest(ray, first).distance(first.at(2.0)) < 0.4
    }
}

/// The point of a ray that is nearest to one on the first.
fn p_nearest(ray: &Ray, first: &Ray) -> Vec3 {
    ray.at((first.at(2.0) - ray.origin).dot(ray.dir))
}

fn first_ray(case: &Case) -> Ray {
    let plain = emitter(&case.prepared);
    let mut photons = (0..).filter_map(|i| emit(&plain, 50, i));
    photons.next().expect("light leaves").ray
}

/// An emitter that is aimed at where the rays of some photons went.
fn aimed<'a>(case: &'a Case, first: &Ray) -> Emitter<'a> {
    let plain = emitter(&case.prepared);
    let rays: Vec<UsefulRay> = (0..4_000)
        .filter_map(|i| emit(&plain, 51, i))
        .filter(|photon| is_near(case, &photon.ray, first))
        .map(|photon| UsefulRay {
            light: photon.light,
            dir: photon.ray.dir,
            p_met: p_nearest(&photon.ray, first),
            luminance: photon.power.luminance(),
            density: photon.density,
        })
        .collect();
    assert!(rays.len() > 30, "{}: {} rays", case.name, rays.len());
    plain.aimed_by(&rays)
}

#[test]
fn aimed_photons_bring_the_same_light_to_all_places() {
    let mut family = Family::new("power of aimed photons");
    for case in cases() {
        let first = first_ray(&case);
        let power = |emitter: &Emitter<'_>, stream, wants_near| {
            let of_draw = |i| {
                let photon = emit(emitter, stream, i);
                let photon =
                    photon.filter(|photon| is_near(&case, &photon.ray, &first) == wants_near);
                photon.map_or(0.0, |photon| project(photon.power))
            };
            Moments::of(&(0..N_DRAWS).map(of_draw).collect::<Vec<f64>>())
        };
        let (plain, aimed) = (emitter(&case.prepared), aimed(&case, &first));
        for wants_near in [true, false] {
            let (a, b) = (power(&plain, 52, wants_near), power(&aimed, 53, wants_near));
            if a.mean > 0.0 || b.mean > 0.0 {
                let what = format!("{}, near: {wants_near}", case.name);
                family.add(what, welch_p(&a, &b, 1e-4 * a.mean));
            }
        }
    }
    family.check();
}

#[test]
fn more_photons_go_where_they_are_aimed() {
    for case in cases() {
        let first = first_ray(&case);
        let share_near = |emitter: &Emitter<'_>| {
            let photons: Vec<_> = (0..2_000).filter_map(|i| emit(emitter, 54, i)).collect();
            let n_near = photons
                .iter()
                .filter(|p| is_near(&case, &p.ray, &first))
                .count();
            n_near as f64 / photons.len() as f64
        };
        let (plain, aimed) = (
            share_near(&emitter(&case.prepared)),
            share_near(&aimed(&case, &first)),
        );
        // Where nearly all go there anyhow, no more can.
        let expected = (1.5 * plain).min(0.5);
        assert!(aimed >= expected, "{}: {plain}, {aimed}", case.name);
    }
}

#[test]
fn the_density_of_an_aimed_photon_is_known_to_those_who_did_not_send_it() {
    for case in cases() {
        let aimed = aimed(&case, &first_ray(&case));
        let mut n = 0;
        for photon in (0..300).filter_map(|i| emit(&aimed, 55, i)) {
            // From any point of its ray.
            let density = aimed.density(photon.light, photon.ray.at(1.5), photon.ray.dir);
            let ratio = density / photon.density;
            assert!((ratio - 1.0).abs() < 2e-3, "{}: {ratio}", case.name);
            n += 1;
        }
        assert!(n > 100, "{}: {n}", case.name);
    }
}
