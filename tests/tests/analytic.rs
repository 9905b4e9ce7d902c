//! Radiance of a floor against closed forms and quadrature, within half a percent.

use kilauea_math::{DMat4, DVec3, Spectrum};
use kilauea_scene::{Camera, Light, LightShape, Shaping};
use kilauea_tests::{
    Mesh, Picture, Stage, TileFile, black_emitter, check_near, facing_down, light, looking_down,
    matte, orthographic, perspective, preview, rect_light,
};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

const ALBEDO: f64 = 0.8;
const TOLERANCE: f64 = 5e-3;

/// A floor of albedo 0.8 below a light of radiance one, seen where x = z = 0.
fn lit_floor(light: Light) -> Stage {
    let mut stage = Stage::new(looking_down(0.0, 0.0));
    stage.meshes.push(Mesh::floor(1.0));
    stage.materials.push(matte([ALBEDO as f32; 3]));
    stage.lights.push(light);
    stage
}

/// Fails unless the light makes this irradiance at the floor's center.
fn check_irradiance(light: Light, expected: f64, what: &str) {
    let mean = lit_floor(light)
        .render(|s| s.samples_per_pixel = 256)
        .mean();
    check_near(mean, ALBEDO * expected / PI, TOLERANCE, what);
}

/// Irradiance from radiance one on a `2a` by `2b` rectangle, centered at distance `h`: four times
/// that of a quarter over its corner (Howell's catalog, C-10).
fn rect_irradiance(width: f64, length: f64, h: f64) -> f64 {
    let (x, y) = (0.5 * width / h, 0.5 * length / h);
    let term = |x: f64, y: f64| {
        let root = (1.0 + x * x).sqrt();
        x / root * (y / root).atan()
    };
    2.0 * (term(x, y) + term(y, x))
}

#[test]
fn rect_lights() {
    for (width, length, h) in [(1.0, 2.0, 1.0), (0.1, 0.1, 0.5), (20.0, 20.0, 0.5)] {
        let expected = rect_irradiance(width, length, h);
        check_irradiance(rect_light(width, length, h), expected, "rect");
    }
    // As wide as half a sphere.
    let expected = rect_irradiance(1e4, 1e4, 0.5);
    assert!((expected - PI).abs() < 1e-3);
    check_irradiance(rect_light(1e4, 1e4, 0.5), PI, "half space");
}

#[test]
fn disk_lights() {
    for (radius, h) in [(0.5_f64, 1.0_f64), (3.0, 1.0), (0.01, 0.4)] {
        let shape = LightShape::Disk { radius };
        let expected = PI * radius.powi(2) / (radius.powi(2) + h.powi(2));
        check_irradiance(light(shape, facing_down(0.0, h, 0.0)), expected, "disk");
    }
    // The scale of the light's transform counts.
    let scaled = facing_down(0.0, 1.0, 0.0) * DMat4::from_scale(DVec3::new(0.25, 0.25, 3.0));
    let expected = PI * 0.25 / (0.25 + 1.0);
    check_irradiance(
        light(LightShape::Disk { radius: 2.0 }, scaled),
        expected,
        "scaled",
    );
}

#[test]
fn sphere_lights() {
    for (radius, h) in [(0.2_f64, 0.5_f64), (1.0, 1.1), (1e-3, 0.5)] {
        let shape = LightShape::Sphere { radius };
        let at = DMat4::from_translation(DVec3::new(0.0, h, 0.0));
        check_irradiance(light(shape, at), PI * (radius / h).powi(2), "facing");
        let aside = DMat4::from_translation(DVec3::new(2.0, 1.0 + h, 0.0));
        let distance = DVec3::new(2.0, 1.0 + h, 0.0).length();
        let expected = PI * (radius / distance).powi(2) * (1.0 + h) / distance;
        check_irradiance(light(shape, aside), expected, "aside");
    }
}

#[test]
fn ellipsoids_and_cylinders() {
    // An ellipsoid of half axes 0.4, 0.2, 0.3.
    let axes = DVec3::new(0.4, 0.2, 0.3);
    let at = DVec3::new(0.1, 0.7, 0.0);
    let expected = quadrature(|u, v| {
        let (phi, z) = (2.0 * PI * u, 2.0 * v - 1.0);
        let n = (1.0 - z * z).sqrt();
        let unit = DVec3::new(n * phi.cos(), n * phi.sin(), z);
        // Area vectors of a scaled unit sphere.
        let area_vector = 4.0 * PI * unit * axes.element_product() / axes;
        (at + axes * unit, area_vector)
    });
    let shape = LightShape::Sphere { radius: 1.0 };
    let place = DMat4::from_translation(at) * DMat4::from_scale(axes);
    check_irradiance(light(shape, place), expected, "ellipsoid");

    for (radius, length, at) in [
        (0.1, 1.0, DVec3::new(0.0, 0.6, 0.0)),
        (0.4, 5.0, DVec3::new(0.5, 0.6, -0.3)),
    ] {
        let expected = quadrature(|u, v| {
            let normal = DVec3::new(0.0, (2.0 * PI * u).cos(), (2.0 * PI * u).sin());
            let p = at + radius * normal + (v - 0.5) * length * DVec3::X;
            (p, 2.0 * PI * radius * length * normal)
        });
        let shape = LightShape::Cylinder { radius, length };
        let place = DMat4::from_translation(at);
        check_irradiance(light(shape, place), expected, "cylinder");
    }
}

/// Irradiance at the origin, normal +y, from radiance one on a closed surface given by its points
/// and area vectors over (u, v) in [0, 1)²; midpoint rule.
fn quadrature(surface: impl Fn(f64, f64) -> (DVec3, DVec3)) -> f64 {
    const N: usize = 1000;
    let cell = |i: usize| (i as f64 + 0.5) / N as f64;
    let terms = (0..N * N).map(|i| {
        let (p, area_vector) = surface(cell(i % N), cell(i / N));
        let distance_sq = p.length_squared();
        let cosines = p.y.max(0.0) * -area_vector.dot(p).min(0.0);
        cosines / (distance_sq * distance_sq)
    });
    terms.sum::<f64>() / (N * N) as f64
}

#[test]
fn distant_lights() {
    for angle_degrees in [0.53_f64, 20.0, 90.0, 180.0] {
        let shape = LightShape::Distant { angle_degrees };
        let sine = (0.5 * angle_degrees.to_radians()).sin();
        let place = facing_down(0.0, 0.0, 0.0);
        check_irradiance(light(shape, place), PI * sine * sine, "overhead");
    }
    // Parallel light: `radiance` is the irradiance on a surface that faces it.
    let shape = LightShape::Distant { angle_degrees: 0.0 };
    check_irradiance(light(shape, facing_down(0.0, 0.0, 0.0)), 1.0, "parallel");
    let tilted = DMat4::from_rotation_x(-FRAC_PI_4);
    check_irradiance(light(shape, tilted), FRAC_PI_4.cos(), "parallel and tilted");
    let shape = LightShape::Distant {
        angle_degrees: 10.0,
    };
    let expected = PI * 5.0_f64.to_radians().sin().powi(2) * FRAC_PI_4.cos();
    check_irradiance(light(shape, tilted), expected, "tilted");
}

#[test]
fn constant_domes() {
    check_irradiance(light(LightShape::Dome, DMat4::IDENTITY), PI, "dome");
    let scaled = DMat4::from_scale(DVec3::new(3.0, 0.1, 1.0));
    check_irradiance(light(LightShape::Dome, scaled), PI, "scaled dome");
}

/// A floor under a dome with a picture.
fn floor_under_picture(picture: &TileFile, world_from_light: DMat4) -> Stage {
    let mut stage = lit_floor(light(LightShape::Dome, world_from_light));
    stage.lights[0].texture = Some(0);
    stage.textures.push(picture.source());
    stage
}

#[test]
fn a_dome_that_brightens_toward_its_top() {
    // L = t = 1 − θ/π gives E = 2π ∫ (1 − θ/π) sin θ cos θ dθ = 3π/4 over the upper half.
    let picture = TileFile::new([128, 256], |_, y| [(y as f32 + 0.5) / 256.0; 3]);
    let mean = |place| floor_under_picture(&picture, place).render(|_| ()).mean();
    let upright = DMat4::IDENTITY;
    check_near(mean(upright), ALBEDO * 0.75, TOLERANCE, "upright");
    let flipped = DMat4::from_rotation_x(PI);
    check_near(mean(flipped), ALBEDO * 0.25, TOLERANCE, "upside down");
}

/// Red toward +x, green toward +y, blue toward +z: light of the half space around an axis.
#[test]
fn a_dome_is_mapped_as_usd_says() {
    let picture = TileFile::new([256, 128], |x, y| {
        [x < 128, y >= 64, (64..192).contains(&x)].map(|is_lit| f32::from(u8::from(is_lit)))
    });
    let (third_turn, axes) = (2.0 * PI / 3.0, DVec3::ONE.normalize());
    for (n_turns, expected) in [[0.5, 1.0, 0.5], [1.0, 0.5, 0.5], [0.5, 0.5, 1.0]]
        .into_iter()
        .enumerate()
    {
        // Turning by a third around (1, 1, 1) takes x to y to z.
        let place = DMat4::from_axis_angle(axes, third_turn * n_turns as f64);
        let picture = floor_under_picture(&picture, place).render(|_| ());
        for (channel, expected) in ["R", "G", "B"].into_iter().zip(expected) {
            let what = format!("{channel} after {n_turns} turns");
            check_near(
                picture.mean_of(channel),
                ALBEDO * expected,
                TOLERANCE,
                &what,
            );
        }
    }
}

#[test]
fn a_sun_in_a_dome_is_sampled_where_it_is() {
    // Sixteen texels, well above the horizon.
    let is_sun = |x: u32, y: u32| x / 4 == 40 && y / 4 == 24;
    let picture = TileFile::new([256, 128], |x, y| {
        [if is_sun(x, y) { 1000.0 } else { 0.1 }; 3]
    });
    let stage = floor_under_picture(&picture, DMat4::IDENTITY);
    let picture = stage.render(|s| s.samples_per_pixel = 16);
    let mean = picture.mean();
    let squares = picture.channel("R").iter().map(|&r| f64::from(r).powi(2));
    let deviation = (squares.sum::<f64>() / 256.0 - mean * mean).sqrt() / mean;
    // 0.14 as it is; 4 where the sun is looked for elsewhere.
    assert!(
        deviation < 0.25,
        "relative deviation of pixels: {deviation}"
    );
    let sun: f64 = (96..100)
        .map(|row| PI * (1.0 - (f64::from(row) + 0.5) / 128.0))
        .map(|theta| 4.0 * 1000.0 * theta.sin() * theta.cos() * (PI / 128.0).powi(2))
        .sum();
    check_near(mean, ALBEDO * (sun / PI + 0.1), 0.02, "sun and sky");
}

#[test]
fn emissive_mesh_equals_rect_light() {
    let mut stage = lit_floor(rect_light(1.0, 2.0, 1.0));
    stage.lights.clear();
    let quad = [
        [-0.5, 1.0, 1.0],
        [-0.5, 1.0, -1.0],
        [0.5, 1.0, -1.0],
        [0.5, 1.0, 1.0],
    ];
    stage.meshes.push(Mesh::polygon(&quad).with_material(1));
    stage.materials.push(black_emitter(1.0));
    let expected = ALBEDO * rect_irradiance(1.0, 2.0, 1.0) / PI;
    check_near(stage.render(|_| ()).mean(), expected, TOLERANCE, "mesh");
}

#[test]
fn multipliers_reach_their_lobes() {
    let render = |diffuse, specular| {
        let mut light = rect_light(1.0, 2.0, 1.0);
        (light.diffuse, light.specular) = (diffuse, specular);
        let mut stage = lit_floor(light);
        stage.materials = vec![preview(&[("diffuseColor", &[0.5; 3])])];
        let picture = stage.render(|_| ());
        ["direct_diffuse.R", "direct_specular.R"].map(|layer| picture.mean_of(layer))
    };
    let [diffuse, specular] = render(1.0, 1.0);
    assert!(diffuse > 0.1 && specular > 1e-3, "{diffuse} {specular}");
    for factors in [[0.5_f32, 1.0], [1.0, 0.0], [0.0, 2.0]] {
        let [d, s] = render(factors[0], factors[1]);
        check_near(
            d + 1.0,
            diffuse * f64::from(factors[0]) + 1.0,
            1e-6,
            "diffuse",
        );
        check_near(
            s + 1.0,
            specular * f64::from(factors[1]) + 1.0,
            1e-6,
            "specular",
        );
    }
}

#[test]
fn shaping_cuts_cones() {
    // Floor points at 20 and 40 degrees off the axis of a cone of 30 degrees.
    let render = |x: f64, shaping| {
        let shape = LightShape::Sphere { radius: 0.01 };
        let mut stage = lit_floor(light(shape, facing_down(0.0, 1.0, 0.0)));
        stage.lights[0].shaping = shaping;
        stage.camera = looking_down(x, 0.0);
        stage.render(|_| ()).mean()
    };
    let cone = |cone_softness, focus| {
        Some(Shaping {
            cone_angle_degrees: 30.0,
            cone_softness,
            focus,
            focus_tint: Spectrum::BLACK,
        })
    };
    let [inside, outside] = [20.0_f64, 40.0].map(|angle| angle.to_radians().tan());
    let unshaped = render(inside, None);
    check_near(render(inside, cone(0.0, 0.0)), unshaped, 1e-5, "inside");
    assert!(render(outside, None) > 0.0);
    assert_eq!(render(outside, cone(0.0, 0.0)), 0.0);
    // Smoothstep from the axis on: at two thirds of the cone 1 − (3 − 4/3) 4/9 = 7/27 is left.
    let fade = render(inside, cone(1.0, 0.0)) / unshaped;
    check_near(fade, 7.0 / 27.0, 0.02, "soft");
    let focused = render(inside, cone(0.0, 4.0)) / unshaped;
    let expected = 20.0_f64.to_radians().cos().powi(4);
    check_near(focused, expected, 0.01, "focus");
}

#[test]
fn exposure_scales_all_light() {
    let mut stage = lit_floor(rect_light(1.0, 2.0, 1.0));
    let before = stage.render(|_| ());
    stage.camera.exposure_scale = 4.0;
    let after = stage.render(|_| ());
    for layer in ["R", "G", "B", "direct_diffuse.G"] {
        check_near(
            after.mean_of(layer),
            4.0 * before.mean_of(layer),
            1e-6,
            layer,
        );
    }
    assert_eq!(after.mean_of("albedo.R"), before.mean_of("albedo.R"));
}

/// A floor with an albedo, seen from above by a camera; nothing but its place matters.
fn positions(camera: Camera) -> Picture {
    let mut stage = lit_floor(light(LightShape::Dome, DMat4::IDENTITY));
    stage.meshes = vec![Mesh::floor(10.0)];
    stage.camera = camera;
    stage.render(|_| ())
}

#[test]
fn cameras_see_what_they_should() {
    // Both see x from −2 to 2; pixels are a quarter wide.
    let eye = [0.0, 4.0, 0.0];
    for camera in [
        perspective(eye, [0.0; 3], 0.5),
        orthographic(eye, [0.0; 3], 2.0),
    ] {
        let picture = positions(camera);
        check_near(picture.mean(), ALBEDO, TOLERANCE, "radiance");
        for (channel, of_pixel) in [("P.X", 0), ("P.Z", 1)] {
            for (idx, &p) in picture.channel(channel).iter().enumerate() {
                let pixel = [idx % 16, idx / 16][of_pixel];
                let center = -2.0 + 0.25 * (pixel as f32 + 0.5);
                assert!((p - center).abs() <= 0.125, "{channel} of {idx}: {p}");
            }
        }
        for &z in picture.channel("Z") {
            assert!((z - 4.0).abs() < 1e-5, "{z}");
        }
        assert!(picture.channel("N.Y").iter().all(|&n| n == 1.0));
    }
}

#[test]
fn lenses_blur_what_is_out_of_focus() {
    // A floor half black and half white, its edge below the camera at distance 4. Defocused by a
    // lens of radius 1 the edge spreads over 2 · 1 · |4 − focus| / focus.
    let render = |lens_radius, focus_distance| {
        let mut stage = lit_floor(light(LightShape::Dome, DMat4::IDENTITY));
        let half = [
            [0.0, 0.0, 9.0],
            [9.0, 0.0, 9.0],
            [9.0, 0.0, -9.0],
            [0.0, 0.0, -9.0],
        ];
        stage.meshes = vec![Mesh::polygon(&half)];
        stage.lights[0].visible_to_camera = false;
        stage.camera = perspective([0.0, 4.0, 0.0], [0.0; 3], 0.5);
        (stage.camera.lens_radius, stage.camera.focus_distance) = (lens_radius, focus_distance);
        let picture = stage.render(|s| s.samples_per_pixel = 256);
        let row = &picture.channel("A")[8 * 16..9 * 16];
        row.iter().filter(|&&a| a > 0.01 && a < 0.99).count()
    };
    assert_eq!(render(0.0, 2.0), 0);
    assert_eq!(render(1.0, 4.0), 0);
    // Radius 0.5 at focus 2: half a unit to each side of 0, over two pixels each.
    assert_eq!(render(0.5, 2.0), 4);
}

#[test]
fn depth_counts_bounces() {
    // Two floors that face each other, and a light between that the camera sees.
    let mut stage = lit_floor(rect_light(1.0, 2.0, 1.0));
    let ceiling = Mesh::floor(1.0).placed(kilauea_math::DAffine3::from_translation(2.0 * DVec3::Y));
    stage.meshes.push(ceiling);
    let at_floor = |depth| stage.render(|s| s.max_depth = depth);
    let dark = at_floor(0);
    assert_eq!(dark.mean(), 0.0);
    assert_eq!(dark.mean_of("A"), 1.0);
    assert_eq!(dark.stats.rays.shadow + dark.stats.rays.indirect, 0);
    let direct = at_floor(1);
    assert_eq!(direct.mean_of("indirect_diffuse.R"), 0.0);
    let expected = ALBEDO * rect_irradiance(1.0, 2.0, 1.0) / PI;
    check_near(direct.mean(), expected, TOLERANCE, "direct");
    let full = at_floor(16);
    assert!(full.mean_of("indirect_diffuse.R") > 1e-3);
    for channel in ["direct_diffuse.R", "emission.R"] {
        assert_eq!(direct.channel(channel), full.channel(channel), "{channel}");
    }

    let mut toward_light = stage.clone();
    toward_light.camera = orthographic([0.0, 0.5, 0.0], [0.0, 1.0, 0.0], 0.1);
    let picture = toward_light.render(|s| s.max_depth = 0);
    check_near(picture.mean_of("emission.R"), 1.0, 1e-6, "the light itself");
    toward_light.lights[0].visible_to_camera = false;
    let picture = toward_light.render(|s| s.max_depth = 0);
    assert_eq!(picture.mean(), 0.0, "a light that the camera does not see");
}

/// Lights shine from one side, and through nothing.
#[test]
fn occlusion_and_sides() {
    let mut stage = lit_floor(rect_light(1.0, 1.0, 1.0));
    stage.lights[0].world_from_light =
        DMat4::from_translation(DVec3::Y) * DMat4::from_rotation_x(FRAC_PI_2);
    assert_eq!(stage.render(|s| s.max_depth = 1).mean(), 0.0, "faces away");

    let mut stage = lit_floor(rect_light(1.0, 1.0, 1.0));
    let cover = Mesh::floor(5.0).placed(kilauea_math::DAffine3::from_translation(0.5 * DVec3::Y));
    stage.meshes.push(cover);
    assert_eq!(stage.render(|s| s.max_depth = 1).mean(), 0.0, "covered");
}
