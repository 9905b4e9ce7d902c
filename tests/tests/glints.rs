//! Bright spots at infinity that a mirror shows, which is one lobe among others.

use kilauea_math::{DMat4, Spectrum};
use kilauea_scene::{Light, LightShape, Material};
use kilauea_tests::{
    Mesh, Picture, Stage, TileFile, check_near, facing_down, light, orthographic, preview,
};

/// What a clear coat of index 1.5 reflects at normal incidence.
const COAT: f64 = 0.04;
const RADIANCE: f32 = 1e4;
const SAMPLES: u32 = 16;

fn coated() -> Material {
    preview(&[
        ("diffuseColor", &[0.5; 3]),
        ("specularColor", &[0.0; 3]),
        ("useSpecularWorkflow", &[1.0]),
        ("clearcoat", &[1.0]),
        ("clearcoatRoughness", &[0.0]),
    ])
}

/// A floor of the material from straight above, so that mirrors show the zenith alone.
fn floor(material: Material, lights: Vec<Light>) -> Stage {
    let mut stage = Stage::new(orthographic([0.0, 1.0, 0.0], [0.0; 3], 0.5));
    stage.materials = vec![material];
    stage.meshes.push(Mesh::floor(1.0));
    stage.lights = lights;
    stage
}

fn render(stage: &Stage) -> Picture {
    stage.render(|s| {
        s.resolution = [32, 32];
        s.samples_per_pixel = SAMPLES;
    })
}

/// Deviation of one sample over the mean of all.
fn deviation(picture: &Picture) -> f64 {
    let variance = picture.mean_of("variance") * f64::from(SAMPLES);
    variance.sqrt() / picture.mean()
}

fn sun(degrees_from_zenith: f64) -> Light {
    let down = facing_down(0.0, 0.0, 0.0);
    let shape = LightShape::Distant { angle_degrees: 1.0 };
    Light {
        radiance: Spectrum::splat(RADIANCE),
        ..light(
            shape,
            DMat4::from_rotation_x(degrees_from_zenith.to_radians()) * down,
        )
    }
}

/// The coat shows that much of a bright spot, to each sample: drawn as often as by what it scatters
/// of even light, samples would be off by some times the mean.
fn check(picture: &Picture, glint: f64) {
    check_near(glint, COAT * f64::from(RADIANCE), 0.02, "glint");
    assert!(deviation(picture) < 0.1, "{}", deviation(picture));
}

#[test]
fn a_coat_shows_the_sun_in_every_sample() {
    let at = |degrees| render(&floor(coated(), vec![sun(degrees)]));
    let (seen, beside) = (at(0.2), at(0.8));
    check(&seen, seen.mean() - beside.mean());
}

#[test]
fn a_coat_shows_the_sun_of_a_sky_in_every_sample() {
    const ROWS: u32 = 128;
    let sky = TileFile::new([2 * ROWS, ROWS], |_, y| {
        [if y >= ROWS - 4 { RADIANCE } else { 1.0 }; 3]
    });
    let mut stage = floor(coated(), vec![light(LightShape::Dome, DMat4::IDENTITY)]);
    stage.lights[0].texture = Some(0);
    stage.textures.push(sky.source());
    let picture = render(&stage);
    // The base is lit by the spot as well: its light is in another layer.
    check(&picture, picture.mean_of("direct_specular.R"));
}
