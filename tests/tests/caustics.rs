//! Caustics by photons beside paths: the same light, found in other ways.

use kilauea_math::{DMat4, DVec3, Spectrum};
use kilauea_render::PreparedScene;
use kilauea_scene::{
    CausticStrategy, GlobalIllumination, Light, LightShape, Material, PhotonSettings,
    RenderSettings, Shading,
};
use kilauea_testing::{Family, Moments, welch_p};
use kilauea_tests::{
    Mesh, Picture, Sphere, Stage, black_emitter, facing_down, glass, light, matte, perspective,
    preview, rect_light,
};
use std::sync::Arc;

const RADIUS: f32 = 0.05;

/// A ball over a floor under `lamp`, from above; most light on the floor below is a caustic.
fn ball(material: Material, lamp: Light) -> Stage {
    let mut stage = Stage::new(perspective([1.5, 2.0, 0.0], [0.0, 0.2, 0.0], 0.45));
    stage.materials = vec![matte([0.7, 0.6, 0.5]), material];
    stage.meshes.push(Mesh::floor(2.0));
    stage.spheres.push(Sphere {
        center: [0.0, 0.6, 0.0],
        radius: 0.4,
        material: 1,
    });
    stage.lights.push(lamp);
    stage
}

/// A lamp that paths find often enough to be compared with.
fn lamp() -> Light {
    bright(LightShape::Disk { radius: 0.4 }, 2.5)
}

fn bright(shape: LightShape, height: f64) -> Light {
    Light {
        radiance: Spectrum::splat(5.0),
        ..light(shape, facing_down(0.3, height, 0.2))
    }
}

fn clear() -> Material {
    glass(&[("ior", &[1.5])])
}

fn metal(roughness: f32) -> Material {
    preview(&[
        ("diffuseColor", &[0.9, 0.8, 0.7]),
        ("metallic", &[1.0]),
        ("roughness", &[roughness]),
    ])
}

fn settings() -> RenderSettings {
    RenderSettings {
        samples_per_pixel: 32,
        max_depth: 6,
        aovs: vec!["IndirectDiffuse".into(), "IndirectSpecular".into()],
        ..Stage::settings()
    }
}

fn consistent(found_by: CausticStrategy, radius: f32) -> RenderSettings {
    RenderSettings {
        gi: GlobalIllumination::Consistent,
        photons: PhotonSettings {
            emitted_per_sample: Some(1000),
            radius: Some(radius),
            found_by,
        },
        ..settings()
    }
}

/// Means of the whole picture, over seeds. Merging moves light by a radius at most, so that next to
/// nothing of it leaves the picture.
fn means(prepared: &Arc<PreparedScene>, settings: &RenderSettings, n_seeds: u32) -> Moments {
    let first = settings.photons.found_by as u32 * 100;
    let mean = |seed| {
        let settings = RenderSettings {
            seed: first + seed,
            ..settings.clone()
        };
        Picture::render(prepared, settings).mean()
    };
    Moments::of(&(1..=n_seeds).map(mean).collect::<Vec<_>>())
}

/// Each strategy alone finds the whole light of caustics, and so do all of them together: what none
/// counts is counted by another, and nothing twice.
#[test]
fn all_strategies_find_the_same_light() {
    let sun = |angle_degrees| Light {
        radiance: Spectrum::splat(if angle_degrees > 0.0 { 100.0 } else { 1.0 }),
        ..light(
            LightShape::Distant { angle_degrees },
            facing_down(0.0, 0.0, 0.0),
        )
    };
    let mut family = Family::new("strategies");
    let mut check = |name: &str, stage: &Stage| {
        let prepared = stage.prepare(&settings());
        let by_paths = means(&prepared, &settings(), 12);
        for found_by in [
            CausticStrategy::All,
            CausticStrategy::Photons,
            CausticStrategy::Paths,
        ] {
            let found = means(&prepared, &consistent(found_by, RADIUS), 12);
            // Edges of the ball and of the floor lose a little of what is merged there.
            let p = welch_p(&by_paths, &found, 3e-3 * by_paths.mean);
            println!(
                "{name} {found_by:?}: {:.5} {:.1e}, by paths {:.5} {:.1e}",
                found.mean,
                found.standard_error(),
                by_paths.mean,
                by_paths.standard_error()
            );
            family.add(format!("{name}, by {found_by:?}"), p);
        }
    };
    check("glass", &ball(clear(), lamp()));
    check("a mirror", &ball(metal(0.0), lamp()));
    check("nearly a mirror", &ball(metal(0.045), lamp()));
    check("a low sun", &ball(clear(), sun(10.0)));
    check(
        "a point of a sun, nearly a mirror",
        &ball(metal(0.045), sun(0.0)),
    );
    check(
        "a dome",
        &ball(clear(), light(LightShape::Dome, DMat4::IDENTITY)),
    );
    let sphere = bright(LightShape::Sphere { radius: 0.3 }, 1.8);
    check("a sphere that shines", &ball(clear(), sphere));

    let mut shining_mesh = ball(clear(), lamp());
    shining_mesh.lights.clear();
    shining_mesh.materials.push(black_emitter(5.0));
    let quad = [
        [-0.3, 2.0, 0.3],
        [-0.3, 2.0, -0.3],
        [0.3, 2.0, -0.3],
        [0.3, 2.0, 0.3],
    ];
    shining_mesh
        .meshes
        .push(Mesh::polygon(&quad).with_material(2));
    check("a mesh that shines", &shining_mesh);

    let mut glossy_floor = ball(clear(), lamp());
    glossy_floor.materials[0] = preview(&[("diffuseColor", &[0.3; 3]), ("roughness", &[0.2])]);
    check("a glossy floor", &glossy_floor);

    let mut in_a_mirror = ball(clear(), lamp());
    in_a_mirror.camera = perspective([0.0, 0.3, 1.8], [0.0, 0.3, 3.0], 0.8);
    in_a_mirror.materials.push(metal(0.0));
    let wall = [
        [-2.0, 0.0, 2.5],
        [-2.0, 2.0, 2.5],
        [2.0, 2.0, 2.5],
        [2.0, 0.0, 2.5],
    ];
    in_a_mirror
        .meshes
        .push(Mesh::polygon(&wall).with_material(2));
    check("seen in a mirror", &in_a_mirror);

    let mut inside = ball(clear(), lamp());
    inside.camera = perspective([0.0, 0.7, 0.0], [0.1, 0.0, 0.1], 0.6);
    check("seen from within the glass", &inside);
    family.check();
}
