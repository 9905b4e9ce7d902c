//! Lights of no size, and of every brightness.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_scene::{Camera, Light, LightShape};
use kilauea_tests::{Mesh, Picture, Stage, facing_down, light, matte, perspective, rect_light};

fn floor(lights: Vec<Light>) -> Stage {
    let mut stage = Stage::new(perspective([0.0, 1.2, 3.0], [0.0, 0.4, 0.0], 0.5));
    stage.materials = vec![matte([0.7, 0.6, 0.5])];
    stage.meshes.push(Mesh::floor(2.0));
    stage.meshes.push(Mesh::cube_face(4));
    stage.lights = lights;
    stage
}

fn render(lights: Vec<Light>) -> Picture {
    let (picture, _) = floor(lights).render_damaged(|s| s.samples_per_pixel = 16);
    picture.check_finite("lights");
    picture
}

fn lamp() -> Light {
    rect_light(1.0, 1.0, 2.0)
}

#[test]
fn lights_without_area_emit_nothing() {
    let expected = render(vec![lamp()]);
    assert!(expected.mean() > 0.01);
    let flat = DMat4::from_scale(DVec3::new(0.0, 1.0, 1.0));
    for shape in [
        LightShape::Rect {
            width: 0.0,
            height: 1.0,
        },
        LightShape::Disk { radius: 0.0 },
        LightShape::Sphere { radius: 0.0 },
        LightShape::Cylinder {
            radius: 0.0,
            length: 1.0,
        },
        LightShape::Cylinder {
            radius: 1.0,
            length: 0.0,
        },
    ] {
        let picture = render(vec![lamp(), light(shape, facing_down(0.0, 1.0, 0.0))]);
        expected.check_same_bits(&picture, &format!("{shape:?}"));
    }
    let rect = LightShape::Rect {
        width: 1.0,
        height: 1.0,
    };
    let picture = render(vec![lamp(), light(rect, facing_down(0.0, 1.0, 0.0) * flat)]);
    expected.check_same_bits(&picture, "a rect scaled to a line");
}

/// A lamp over a floor, both multiplied.
fn lamp_and_floor(size: f64) -> Stage {
    let camera = perspective([0.0, 1.2 * size, 3.0 * size], [0.0, 0.4 * size, 0.0], 0.5);
    let mut stage = Stage::new(Camera {
        clipping_range: [1e-3 * size, 1e3 * size],
        ..camera
    });
    stage.materials = vec![matte([0.7, 0.6, 0.5])];
    let place = DAffine3::from_scale(DVec3::splat(size));
    stage.meshes.push(Mesh::floor(2.0).placed(place));
    stage.lights.push(rect_light(size, size, 2.0 * size));
    stage
}

#[test]
fn lamps_of_any_size_light_alike() {
    let mean = |size| {
        lamp_and_floor(size)
            .render(|s| s.samples_per_pixel = 16)
            .mean()
    };
    let one = mean(1.0);
    assert!(one > 0.01);
    for exponent in [-11, -10, -8, 8, 10, 11] {
        let ratio = mean(10.0_f64.powi(exponent)) / one;
        assert!((ratio - 1.0).abs() < 1e-4, "1e{exponent}: {ratio}");
        super::report(
            "lights",
            format!("a lamp of 1e{exponent} over one of 1"),
            ratio,
        );
    }
}

/// Light is linear: a power of two changes nothing but exponents.
#[test]
fn any_brightness_scales_the_picture_exactly() {
    let expected = render(vec![lamp()]);
    for exponent in [-100, -30, 30, 60, 100] {
        let factor = 2.0_f32.powi(exponent);
        let picture = render(vec![Light {
            radiance: Spectrum::splat(factor),
            ..lamp()
        }]);
        assert_eq!(picture.stats.invalid_samples, 0);
        for channel in ["R", "G", "B"] {
            let pairs = picture
                .channel(channel)
                .iter()
                .zip(expected.channel(channel));
            for (&bright, &one) in pairs {
                let error = (bright / factor - one).abs();
                assert!(error <= 1e-6 * one, "2^{exponent}: {bright:e} {one}");
            }
        }
        super::report(
            "lights",
            format!("intensity 2^{exponent}: mean"),
            picture.mean(),
        );
    }
}

/// Five lights above the floor, one of them smaller.
fn ceiling(radiance: f32) -> Vec<Light> {
    let lamp = |i: u32| {
        let width = if i == 0 { 6.0 } else { 60.0 };
        let shape = LightShape::Rect {
            width,
            height: 60.0,
        };
        Light {
            radiance: Spectrum::splat(radiance),
            visible_to_camera: false,
            ..light(shape, facing_down(f64::from(i), 2.0, 0.0))
        }
    };
    (0..5).map(lamp).collect()
}

/// Each power is more than f32 holds, and so is their sum.
#[test]
fn huge_lights_leave_the_choice_of_lights_sound() {
    let (one, huge) = (render(ceiling(1.0)), render(ceiling(1e36)));
    assert_eq!(huge.stats.invalid_samples, 0);
    let ratio = huge.mean() / one.mean() / 1e36;
    // One is chosen less often than its power deserves, so the two do not have the same noise.
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    super::report("lights", "five of 1e36 nits over five of 1", ratio * 1e36);
}

#[test]
fn negative_light_darkens_by_what_it_would_light() {
    let with = |radiance: f32| {
        render(vec![Light {
            radiance: Spectrum::splat(radiance),
            ..lamp()
        }])
    };
    let (light, shade) = (with(1.0), with(-1.0));
    for channel in ["R", "G", "B"] {
        let pairs = light.channel(channel).iter().zip(shade.channel(channel));
        for (a, b) in pairs {
            assert!((a + b).abs() <= 1e-6 * a.abs(), "{channel}: {a} {b}");
        }
    }
    super::report("lights", "negative: mean", shade.mean());
}

#[test]
fn a_light_of_no_number_is_refused_and_named() {
    for radiance in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let broken = Light {
            path: "/Lights/Broken".into(),
            radiance: Spectrum::splat(radiance),
            ..lamp()
        };
        let message = floor(vec![broken]).refusal().unwrap_or_default();
        assert!(message.contains("/Lights/Broken: radiance"), "{message}");
    }
}
