//! Directions and points against the densities stated for them.

use kilauea_accel::Ray;
use kilauea_math::{DVec3, Frame, Vec2, Vec3};
use kilauea_scene::MeshChunk;
use kilauea_testing::{Directions, Draw, Family, Rectangle, compare, uniforms};
use std::f32::consts::PI;

use super::super::{Emitter, LightRay};
use super::cases::{BLOCK, Case, cases, emitter};
use crate::PreparedScene;
use crate::light::{ByImportance, InfiniteLight};
use crate::statistics::lights::turned;

const N_DRAWS: u32 = 8_000;

/// The only light's ray; rays of what does not shine there included.
fn leave(emitter: &Emitter<'_>, [a, b, c, d]: [f32; 4]) -> Option<LightRay> {
    let ray = emitter.leave(0, Vec2::new(a, b), Vec2::new(c, d));
    ray.map(|leaving| leaving.chosen)
}

/// The density of a direction by code that does not draw.
fn direction_pdf(prepared: &PreparedScene, dir: Vec3) -> f64 {
    let lights = &prepared.lights;
    let pdf = if let Some(area) = lights.area.first() {
        // Directions in which a light does not shine are lost.
        let shines = area.cross_section(dir).is_some();
        if shines {
            area.emission_cone().pdf(dir)
        } else {
            0.0
        }
    } else {
        match lights.infinite.first() {
            Some(InfiniteLight::Distant(l)) => l.radiance_and_pdf(-dir).map_or(0.0, |(_, pdf)| pdf),
            Some(InfiniteLight::Dome(l)) => l.emission_pdf(-dir, &prepared.textures),
            None => {
                let corner = |i: usize| Vec3::from_array(first_chunk(prepared).positions[i]);
                let n = (corner(1) - corner(0)).cross(corner(2) - corner(0));
                dir.dot(n.normalize()).abs() / (2.0 * PI)
            }
        }
    };
    f64::from(pdf)
}

fn first_chunk(prepared: &PreparedScene) -> &MeshChunk {
    &prepared.scene.prototypes[0].chunks[0]
}

/// Whether a line in the unit direction `dir` through `p` starts at the light.
fn is_lit(prepared: &PreparedScene, p: Vec3, dir: Vec3) -> bool {
    let back = Ray::new(p + 20.0 * dir, -dir);
    let lights = &prepared.lights;
    if lights.has_area_lights() {
        let mut is_met = false;
        lights.for_each_area_hit(&back, None, ByImportance, &prepared.textures, |_, _| {
            is_met = true;
        });
        return is_met;
    }
    if lights.infinite.is_empty() {
        return prepared.geometry.accel().intersect(&back).is_some();
    }
    let [min, max] = BLOCK;
    let (a, b) = ((min - p) / dir, (max - p) / dir);
    a.min(b).max_element() <= a.max(b).min_element()
}

#[test]
fn directions_are_drawn_with_their_density() {
    let mut family = Family::new("directions of photons");
    for case in cases() {
        let emitter = emitter(&case.prepared);
        let draw = |i| match leave(&emitter, uniforms(family.len() as u32, i)) {
            Some(ray) if case.name == "parallel" => Draw::Atom {
                idx: 0,
                probability: f64::from(ray.pdf_direction),
            },
            Some(ray) => Draw::At(ray.dir),
            None => Draw::Lost,
        };
        let light_z = turned().transform_vector3(DVec3::NEG_Z).as_vec3();
        let half_angle = if case.name == "sun" { 0.005 } else { 1.0 };
        let directions =
            Directions::around(light_z + 0.3 * half_angle * Vec3::X, half_angle as f64);
        let found = compare(&directions, N_DRAWS, draw, |dir| {
            direction_pdf(&case.prepared, dir)
        });
        family.add(format!("{}: {found:?}", case.name), found.p_value());
    }
    family.check();
}

#[test]
fn rays_state_the_density_of_their_direction() {
    for case in cases().iter().filter(|case| case.name != "parallel") {
        let emitter = emitter(&case.prepared);
        for i in 0..200 {
            if let Some(ray) = leave(&emitter, uniforms(3, i)) {
                let pdf = direction_pdf(&case.prepared, ray.dir);
                let stated = f64::from(ray.pdf_direction);
                assert!(
                    (stated / pdf - 1.0).abs() < 0.01,
                    "{}: {stated} {pdf}",
                    case.name
                );
            }
        }
    }
}

#[test]
fn points_are_even_over_the_cross_section() {
    let mut family = Family::new("points of photons");
    for case in cases() {
        let emitter = emitter(&case.prepared);
        let [a, b] = uniforms(11, 5);
        let first = leave(&emitter, [a, b, 0.5, 0.5]).expect("the light shines there");
        let plane = Frame::from_z(first.dir);
        let flat = |p: Vec3| plane.to_local(p).truncate();
        let stream = 100 + family.len() as u32;
        let draw = |i| {
            let [c, d] = uniforms(stream, i);
            leave(&emitter, [a, b, c, d]).map_or(Draw::Lost, |ray| Draw::At(flat(ray.p)))
        };
        let density = |at: Vec2| {
            let p = plane.from_local(at.extend(0.0));
            if is_lit(&case.prepared, p, first.dir) {
                1.0 / f64::from(first.cross_section)
            } else {
                0.0
            }
        };
        let found = compare(&around(&case, flat(first.p)), N_DRAWS, draw, density);
        family.add(format!("{}: {found:?}", case.name), found.p_value());
    }
    family.check();
}

/// All of a case's cross-section, off its center, so that no symmetry hides an error.
fn around(case: &Case, center: Vec2) -> Rectangle {
    let reach = Vec2::new(3.1, 2.9) * if case.is_small() { 0.4 } else { 2.0 };
    Rectangle {
        min: center - reach,
        max: center + reach * 1.07,
    }
}

#[test]
fn the_density_of_a_photon_is_known_to_those_who_did_not_send_it() {
    for case in cases() {
        let emitter = emitter(&case.prepared);
        let mut n = 0;
        for i in 0..200 {
            let [a, b, c, d] = uniforms(7, i);
            let (u_direction, u_point) = (Vec2::new(a, b), Vec2::new(c, d));
            let Some(photon) = emitter.emit(Vec2::splat(0.5), u_direction, u_point) else {
                continue;
            };
            let density = emitter.density(photon.light, photon.ray.origin, photon.ray.dir);
            let ratio = density / photon.density;
            assert!((ratio - 1.0).abs() < 1e-3, "{}: {ratio}", case.name);
            n += 1;
        }
        assert!(n > 20, "{}: {n}", case.name);
    }
}
