//! Rays through corners and edges; cameras in, on and far from everything.

use kilauea_math::{DAffine3, DMat4, DVec3};
use kilauea_scene::{Camera, RenderSettings};
use kilauea_tests::{
    Mesh, Picture, Stage, black_emitter, check_near, matte, orthographic, perspective, rect_light,
};

const N: u32 = 32;

/// One sample in each pixel, exactly through its centre.
fn at_centers(settings: &mut RenderSettings) {
    settings.resolution = [N; 2];
    settings.samples_per_pixel = 1;
    settings.filter_radius = Some(1e-12);
}

/// A bumpy sheet of triangles whose corners are seen at the pixels' centres: at the height z, its
/// points are `spread(z)` as far from the axis.
fn sheet(spread: impl Fn(f32) -> f32) -> Mesh {
    let n = N as i32 + 3;
    let at = |i: i32| (i - n / 2) as f32 + 0.5 * f32::from(u8::from(N.is_multiple_of(2)));
    let points = (0..n * n).map(|i| {
        let (x, y) = (i % n, i / n);
        let z = 0.25 * ((7 * x + 3 * y) % 5) as f32;
        [at(x) * spread(z), at(y) * spread(z), z]
    });
    let quads = (0..(n - 1) * (n - 1)).map(|i| i % (n - 1) + n * (i / (n - 1)));
    let triangles = quads.flat_map(|a| [a, a + 1, a + n + 1, a, a + n + 1, a + n]);
    let indices: Vec<i32> = triangles.collect();
    Mesh::new(points.collect(), vec![3; indices.len() / 3], indices)
}

fn check_closed(mut stage: Stage, what: &str) {
    stage.materials = vec![matte([0.5; 3])];
    let picture = stage.render(at_centers);
    picture.check_finite(what);
    let open = picture.channel("A").iter().filter(|&&a| a != 1.0).count();
    assert_eq!(open, 0, "{what}: pixels through which rays passed");
    super::report("cameras", format!("{what}: rays that passed"), open);
}

#[test]
fn rays_through_corners_pass_between_no_triangles() {
    let half = 0.5 * f64::from(N);
    let mut stage = Stage::new(orthographic([0.0, 0.0, 8.0], [0.0; 3], half));
    stage.meshes.push(sheet(|_| 1.0));
    check_closed(stage, "parallel rays");
    // A pixel is one unit wide at a distance of 16.
    let mut stage = Stage::new(perspective([0.0, 0.0, 16.0], [0.0; 3], half / 16.0));
    stage.meshes.push(sheet(|z| (16.0 - z) / 16.0));
    check_closed(stage, "rays from a point");
}

#[test]
fn rays_along_edges_pass_between_no_triangles() {
    // Corners half a pixel off in one direction: rays meet edges, and the diagonals' middles.
    let half = 0.5 * f64::from(N);
    for shift in [DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)] {
        let mut stage = Stage::new(orthographic([0.0, 0.0, 8.0], [0.0; 3], half));
        let place = DAffine3::from_translation(0.5 * shift);
        stage.meshes.push(sheet(|_| 1.0).placed(place));
        check_closed(stage, &format!("edges, shifted by {shift}"));
    }
}

/// A room with walls that shine; the sum over all bounces is 2.
fn furnace(camera: Camera) -> Stage {
    let mut stage = Stage::new(camera);
    let mut walls = kilauea_tests::preview(&[
        ("useSpecularWorkflow", &[1.0]),
        ("diffuseColor", &[0.5; 3]),
        ("emissiveColor", &[1.0; 3]),
    ]);
    walls.path = "/Walls".into();
    stage.materials = vec![walls];
    stage.meshes.push(Mesh::cube());
    stage
}

fn check_furnace(camera: Camera, what: &str) {
    let picture = furnace(camera).render(|s| {
        s.max_depth = 64;
        s.samples_per_pixel = 64;
    });
    picture.check_finite(what);
    assert_eq!(picture.mean_of("A"), 1.0, "{what}: rays got out");
    super::report(
        "cameras",
        format!("{what}: mean, expected 2"),
        picture.mean(),
    );
    check_near(picture.mean(), 2.0, 0.02, what);
}

#[test]
fn any_field_of_view_sees_the_room() {
    for exponent in [-12, -8, -4, 0, 4, 8, 12] {
        let half_width = 10.0_f64.powi(exponent);
        let camera = perspective([0.3, 0.2, 0.1], [0.0, -0.3, -1.0], half_width);
        check_furnace(
            Camera {
                clipping_range: [1e-14, 1e14],
                ..camera
            },
            &format!("a view 1e{exponent} wide"),
        );
    }
}

#[test]
fn a_narrow_view_sees_where_it_aims() {
    let target = [0.25, 0.0, -0.5];
    let mut stage = Stage::new(perspective([0.0, 2.0, 1.0], target, 1e-7));
    stage.materials = vec![matte([0.5; 3])];
    stage.meshes.push(Mesh::floor(1.0));
    let picture = stage.render(|_| ());
    for (axis, expected) in ["P.X", "P.Y", "P.Z"].into_iter().zip(target) {
        for &p in picture.channel(axis) {
            assert!((f64::from(p) - expected).abs() < 1e-6, "{axis}: {p}");
        }
    }
}

#[test]
fn cameras_on_and_in_surfaces_make_numbers() {
    for (what, eye, target) in [
        ("on a wall", [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ("in a wall's plane", [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]),
        ("on a corner", [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]),
        ("along an edge", [1.0, 1.0, 1.0], [1.0, 1.0, -1.0]),
    ] {
        let camera = perspective(eye, target, 0.7);
        let camera = Camera {
            clipping_range: [0.0, 1e5],
            ..camera
        };
        let picture = furnace(camera).render(|s| s.samples_per_pixel = 16);
        picture.check_finite(what);
        super::report("cameras", format!("{what}: mean"), picture.mean());
    }
}

#[test]
fn a_camera_in_a_solid_sees_its_inside() {
    let mut stage = Stage::new(perspective([0.0; 3], [0.0, 0.0, -1.0], 1.0));
    stage.materials = vec![matte([0.5; 3]), black_emitter(3.0)];
    stage.meshes.push(Mesh::cube().with_material(1));
    stage.lights.push(rect_light(1.0, 1.0, 5.0));
    let picture = stage.render(|s| s.max_depth = 4);
    assert_eq!(picture.mean_of("A"), 1.0);
    check_near(picture.mean(), 3.0, 1e-6, "inside of a glowing cube");
}

fn floor(camera: Camera) -> Stage {
    let mut stage = Stage::new(camera);
    stage.materials = vec![matte([0.5; 3])];
    stage.meshes.push(Mesh::floor(1.0));
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    stage
}

fn above() -> Camera {
    perspective([0.0, 2.0, 1.0], [0.0; 3], 0.3)
}

#[test]
fn odd_cameras_make_pictures_of_numbers() {
    let scaled = |x: f64, y: f64, z: f64| Camera {
        world_from_camera: above().world_from_camera * DMat4::from_scale(DVec3::new(x, y, z)),
        ..above()
    };
    for (what, camera) in [
        ("scaled to nothing", scaled(0.0, 0.0, 0.0)),
        ("scaled to a plane", scaled(1.0, 0.0, 1.0)),
        ("scaled by 1e-300", scaled(1e-300, 1e-300, 1e-300)),
        ("mirrored", scaled(-1.0, 1.0, 1.0)),
        (
            "an empty window",
            Camera {
                screen_window: [0.0; 4],
                ..above()
            },
        ),
        (
            "a window inside out",
            Camera {
                screen_window: [0.3, 0.3, -0.3, -0.3],
                ..above()
            },
        ),
        (
            "clipped in reverse",
            Camera {
                clipping_range: [1e5, 1e-3],
                ..above()
            },
        ),
        (
            "clipped behind itself",
            Camera {
                clipping_range: [-1e5, 1e5],
                ..above()
            },
        ),
        (
            "a lens of 1e6",
            Camera {
                lens_radius: 1e6,
                focus_distance: 2.0,
                ..above()
            },
        ),
        (
            "focused on nothing",
            Camera {
                lens_radius: 0.1,
                focus_distance: 0.0,
                ..above()
            },
        ),
    ] {
        let (prepared, _) = floor(camera).prepare_damaged(&Stage::settings());
        let picture = Picture::render_damaged(&prepared, Stage::settings());
        picture.check_finite(what);
        assert_eq!(picture.stats.invalid_samples, 0, "{what}");
        super::report(
            "cameras",
            format!("{what}: invalid rays"),
            picture.stats.invalid_rays,
        );
    }
}

#[test]
fn a_camera_of_no_numbers_is_refused_and_named() {
    let broken = |change: fn(&mut Camera)| {
        let mut camera = above();
        camera.path = "/World/Cam".into();
        change(&mut camera);
        floor(camera).refusal().unwrap_or_default()
    };
    for (message, attribute) in [
        (
            broken(|c| c.world_from_camera.x_axis.y = f64::NAN),
            "xformOps",
        ),
        (
            broken(|c| c.world_from_camera.w_axis.y = f64::INFINITY),
            "xformOps",
        ),
        (
            broken(|c| c.later_world_from_camera = vec![DMat4::NAN]),
            "xformOps",
        ),
        (broken(|c| c.screen_window[2] = f64::NAN), "aperture"),
        (broken(|c| c.clipping_range[0] = f64::NAN), "clippingRange"),
        (broken(|c| c.lens_radius = f64::NAN), "fStop"),
        (broken(|c| c.focus_distance = f64::NAN), "focusDistance"),
        (broken(|c| c.exposure_scale = f32::NAN), "exposure"),
    ] {
        let named = format!("/World/Cam: {attribute}");
        assert!(message.contains(&named), "{named}: {message}");
    }
}
