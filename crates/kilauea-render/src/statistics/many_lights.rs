//! The choice among many lights, of all kinds at once.

use kilauea_gather::{ChoiceField, ChoiceRecords, PictureEstimate, PictureSample};
use kilauea_math::{DMat4, DVec3, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::{Light, LightShape};
use kilauea_testing::{Directions, Family, uniforms};
use std::f64::consts::FRAC_PI_2;

use super::lights::{light, sunny, turned};
use super::lit::{Lit, compare_density, irradiance_p_value, prepare, share_not_found};
use crate::PreparedScene;
use crate::light::{ByCells, ByImportance, Lights, Receiver};

/// Lights in a shell around the origin that do not hide each other's triangles, of radiances that
/// differ a hundredfold.
fn crowd(n: u32) -> Vec<Light> {
    (0..n)
        .map(|i| {
            let [x, y, distance, kind, brightness] = uniforms(77, i);
            let toward = warp::uniform_sphere(Vec2::new(x, y)).as_dvec3();
            let (side, up) = toward.any_orthonormal_pair();
            // Area lights shine toward the origin.
            let place = DMat4::from_cols(
                side.extend(0.0),
                up.extend(0.0),
                toward.extend(0.0),
                (toward * (1.5 + f64::from(distance))).extend(1.0),
            );
            let shape = match (kind * 4.0) as u32 {
                0 => LightShape::Rect {
                    width: 0.6,
                    height: 0.4,
                },
                1 => LightShape::Disk { radius: 0.3 },
                2 => LightShape::Sphere { radius: 0.3 },
                _ => LightShape::Cylinder {
                    radius: 0.15,
                    length: 0.6,
                },
            };
            Light {
                radiance: Spectrum::splat(0.1 * 100.0_f32.powf(brightness)),
                ..light(shape, place)
            }
        })
        .collect()
}

fn triangles() -> [[Vec3; 3]; 2] {
    let [a, b, c, d] = [
        Vec3::new(-1.0, -1.0, 4.0),
        Vec3::new(1.0, -1.0, 4.0),
        Vec3::new(1.0, 1.0, 4.0),
        Vec3::new(-1.0, 1.0, 4.0),
    ];
    [[a, b, c], [a, c, d]]
}

fn scenes() -> Vec<(&'static str, PreparedScene)> {
    let distant = |angle_degrees, place| light(LightShape::Distant { angle_degrees }, place);
    let sunny = sunny();
    let dome = Light {
        texture: Some(0),
        ..light(LightShape::Dome, turned())
    };
    let tilted = DMat4::from_rotation_x(1.1);
    let mut all = crowd(12);
    all.extend([dome, distant(25.0, tilted), distant(0.0, turned())]);
    let parallel = Light {
        radiance: Spectrum::splat(0.3),
        ..distant(0.0, tilted)
    };
    let skies = vec![
        light(LightShape::Dome, DMat4::IDENTITY),
        distant(0.0, turned()),
        parallel,
    ];
    vec![
        ("forty", prepare(crowd(40), &[], Vec::new())),
        ("triangles", prepare(crowd(3), &triangles(), Vec::new())),
        ("skies", prepare(skies, &[], Vec::new())),
        (
            "all kinds",
            prepare(all, &triangles(), vec![sunny.source()]),
        ),
    ]
}

/// Calls `check` with each scene seen from two points, lights chosen by importance.
fn for_each_receiver(mut check: impl FnMut(String, &Lit<'_>, &Directions)) {
    for (name, prepared) in scenes() {
        for (p, n) in [
            (Vec3::ZERO, Vec3::Z),
            (Vec3::new(0.5, -0.3, 0.2), Vec3::new(0.6, 0.0, -0.8)),
        ] {
            let seen = Lit {
                prepared: &prepared,
                receiver: Receiver { p, n },
                chooser: ByImportance,
            };
            let directions = Directions::around(n, FRAC_PI_2);
            check(format!("{name}, at {p}"), &seen, &directions);
        }
    }
}

#[test]
fn directions_are_drawn_with_the_density_that_rays_find() {
    let mut family = Family::new("densities of many lights");
    for_each_receiver(|name, seen, directions| {
        let found = compare_density(seen, directions, family.len() as u32);
        family.add(format!("{name}: {found:?}"), found.p_value());
    });
    family.check();
}

#[test]
fn draws_carry_the_light_that_rays_find() {
    let mut family = Family::new("irradiance of many lights");
    for_each_receiver(|name, seen, directions| {
        let p = irradiance_p_value(seen, directions, family.len() as u32);
        family.add(name, p);
    });
    family.check();
}

#[test]
fn rays_find_the_light_and_density_of_each_draw() {
    for_each_receiver(|name, seen, _| {
        let share = share_not_found(seen, 0);
        assert!(share < 2e-3, "{name}: {share}");
    });
}

/// What is said of lights around a point: anything, most of it about a few.
fn hearsay(lights: &Lights, receiver: Receiver) -> ChoiceField {
    let mut choices = ChoiceRecords::default();
    for i in 0..4000 {
        let [u] = uniforms(5, i);
        let Some(picked) = lights.choose(receiver, u, ByImportance) else {
            continue;
        };
        let turns = lights.turns_to(picked.light, receiver);
        if !turns.is_empty() {
            choices.push([receiver.p, receiver.n], [0; 2], &turns);
            let [is_any] = uniforms(6, picked.light);
            choices.set_last_brought(f32::from(u8::from(is_any < 0.3)));
        }
    }
    let sample = PictureSample {
        pixel: [0; 2],
        luminance: 1.0,
        n_rays: 1.0,
    };
    let picture = PictureEstimate::fit([0; 2], [1; 2], &[sample]).expect("there is light");
    ChoiceField::fit(&choices, &picture).expect("there is a choice")
}

#[test]
fn whatever_is_said_of_lights_draws_have_the_density_and_light_that_rays_find() {
    let mut family = Family::new("densities of lights by hearsay");
    for_each_receiver(|name, seen, directions| {
        let field = hearsay(&seen.prepared.lights, seen.receiver);
        let seen = Lit {
            prepared: seen.prepared,
            receiver: seen.receiver,
            chooser: ByCells {
                field: Some(&field),
            },
        };
        let found = compare_density(&seen, directions, family.len() as u32);
        family.add(format!("{name}: {found:?}"), found.p_value());
        let p = irradiance_p_value(&seen, directions, family.len() as u32);
        family.add(format!("{name}: irradiance"), p);
        let share = share_not_found(&seen, 0);
        assert!(share < 2e-3, "{name}: {share}");
    });
    family.check();
}

#[test]
fn the_likeliest_lights_are_those_of_the_greatest_probability() {
    for_each_receiver(|name, seen, _| {
        let (lights, receiver) = (&seen.prepared.lights, seen.receiver);
        let field = hearsay(lights, receiver);
        let chooser = ByCells {
            field: Some(&field),
        };
        let numbers = 0..lights.len() as u32;
        let mut expected: Vec<(f32, u32)> = numbers
            .map(|light| (lights.probability(light, receiver, chooser), light))
            .filter(|&(probability, _)| probability > 0.0)
            .collect();
        expected.sort_by(|a, b| b.0.total_cmp(&a.0));
        let all = lights.likeliest(receiver, chooser, f32::INFINITY);
        let found: Vec<f32> = all.iter().map(|picked| picked.probability).collect();
        let probabilities: Vec<f32> = expected
            .iter()
            .map(|&(probability, _)| probability)
            .collect();
        assert_eq!(found, probabilities, "{name}");
        for picked in &all {
            let expected = lights.probability(picked.light, receiver, chooser);
            assert_eq!(picked.probability, expected, "{name}: {picked:?}");
        }
        // No more than are asked for.
        let half = lights.likeliest(receiver, chooser, 0.5);
        let made_up = |n: usize| found[..n].iter().sum::<f32>();
        assert!(
            made_up(half.len()) >= 0.5 && made_up(half.len() - 1) < 0.5,
            "{name}"
        );
    });
}

#[test]
fn every_light_is_chosen() {
    let lights = crowd(40);
    let centers: Vec<DVec3> = lights
        .iter()
        .map(|l| l.world_from_light.transform_point3(DVec3::ZERO))
        .collect();
    let prepared = prepare(lights, &[], Vec::new());
    let (p, n) = (Vec3::ZERO, Vec3::Z);
    let receiver = Receiver { p, n };
    let mut is_chosen = vec![false; centers.len()];
    for i in 0..100_000 {
        let [choice, x, y] = uniforms(3, i);
        let geometry = &prepared.geometry;
        let u = Vec2::new(x, y);
        let picked = prepared.lights.choose(receiver, choice, ByImportance);
        let drawn = picked.and_then(|picked| {
            let (lights, textures) = (&prepared.lights, &prepared.textures);
            lights.sample(picked, receiver, u, geometry, textures)
        });
        let Some(drawn) = drawn else { continue };
        let point = (drawn.sample.wi * drawn.sample.distance).as_dvec3();
        let nearest = (0..centers.len()).min_by(|&a, &b| {
            let distance = |i: usize| centers[i].distance_squared(point);
            distance(a).total_cmp(&distance(b))
        });
        is_chosen[nearest.expect("there are lights")] = true;
    }
    let forgotten = is_chosen.iter().filter(|c| !**c).count();
    assert_eq!(forgotten, 0);
}
