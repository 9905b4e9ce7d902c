//! Scenes with a closed form. Those of `tests/scenes/analytic.json` have the names and numbers of
//! their stages.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_scene::{Camera, Light, LightShape};
use kilauea_tests::{
    Mesh, Points, Stage, TileFile, black_emitter, facing_down, light, matte, orthographic,
    perspective, rect_light, with_opacity,
};
use std::f64::consts::{FRAC_PI_6, PI};

const ALBEDO: f64 = 0.8;

/// A scene, the radiance of all its pixels, and how many bounces that takes.
pub(crate) struct Known {
    pub(crate) stage: Stage,
    pub(crate) radiance: f64,
    pub(crate) max_depth: u32,
    /// Its file is there as long as it is.
    picture: Option<TileFile>,
}

/// Makes a scene.
type Make = fn() -> Known;

/// All scenes by name.
pub(crate) const SCENES: [(&str, Make); 11] = [
    ("plane_sphere", plane_sphere),
    ("plane_disk", plane_disk),
    ("plane_rect", plane_rect),
    ("plane_cylinder", plane_cylinder),
    ("plane_distant", plane_distant),
    ("plane_dome", plane_dome),
    ("furnace_sphere", furnace_sphere),
    ("furnace_box", furnace_box),
    ("mesh light", mesh_light),
    ("brightening dome", brightening_dome),
    ("half a roof", half_a_roof),
];

/// The scene of a name.
pub(crate) fn known(name: &str) -> Known {
    let (_, make) = SCENES
        .iter()
        .find(|(known, _)| *known == name)
        .unwrap_or_else(|| panic!("no scene {name}"));
    make()
}

/// Sees so little of a floor that it is one point.
fn at_a_point() -> Camera {
    orthographic([0.0, 0.25, 0.0], [0.0; 3], 5e-4)
}

/// A floor of albedo 0.8 with an irradiance at its center.
fn plane(light: Light, irradiance: f64) -> Known {
    let mut stage = Stage::new(at_a_point());
    stage.meshes.push(Mesh::floor(1.0));
    stage.materials.push(matte([ALBEDO as f32; 3]));
    stage.lights.push(light);
    Known {
        stage,
        radiance: ALBEDO * irradiance / PI,
        max_depth: 4,
        picture: None,
    }
}

/// A light with another radiance.
fn bright(radiance: f64, light: Light) -> Light {
    Light {
        radiance: Spectrum::splat(radiance as f32),
        ..light
    }
}

fn plane_sphere() -> Known {
    let (r, h, radiance): (f64, f64, f64) = (0.5, 2.0, 4.0);
    let place = DMat4::from_translation(DVec3::new(0.0, h, 0.0));
    let sphere = light(LightShape::Sphere { radius: r }, place);
    plane(bright(radiance, sphere), PI * radiance * (r / h).powi(2))
}

fn plane_disk() -> Known {
    let (r, h, radiance): (f64, f64, f64) = (0.5, 1.0, 4.0);
    let disk = light(LightShape::Disk { radius: r }, facing_down(0.0, h, 0.0));
    let irradiance = PI * radiance * r * r / (r * r + h * h);
    plane(bright(radiance, disk), irradiance)
}

pub(crate) mod rect {
    pub(crate) const RADIANCE: f64 = 4.0;
    pub(crate) const HALF_SIZE: [f64; 2] = [0.5, 1.0];
    pub(crate) const HEIGHT: f64 = 1.0;

    /// Howell's catalog, view factor C-10, four times.
    pub(crate) fn irradiance() -> f64 {
        let [a, b] = HALF_SIZE;
        let term = |a: f64, b: f64| {
            let root = a.hypot(HEIGHT);
            a / root * (b / root).atan()
        };
        2.0 * RADIANCE * (term(a, b) + term(b, a))
    }
}

fn plane_rect() -> Known {
    let [a, b] = rect::HALF_SIZE;
    let light = rect_light(2.0 * a, 2.0 * b, rect::HEIGHT);
    plane(bright(rect::RADIANCE, light), rect::irradiance())
}

fn mesh_light() -> Known {
    let mut known = plane_rect();
    let [a, b] = rect::HALF_SIZE.map(|x| x as f32);
    let h = rect::HEIGHT as f32;
    let corners = [[-a, h, b], [-a, h, -b], [a, h, -b], [a, h, b]];
    let light = Mesh::polygon(&corners).with_material(1);
    known.stage.lights.clear();
    known.stage.meshes.push(light);
    known
        .stage
        .materials
        .push(black_emitter(rect::RADIANCE as f32));
    known
}

/// Howell's catalog, view factor B-31, for both halves.
fn plane_cylinder() -> Known {
    let (r, half_length, height, radiance): (f64, f64, f64, f64) = (0.25, 0.75, 1.0, 4.0);
    let (h, z) = (height / r, half_length / r);
    let (x, y) = ((1.0 + h).powi(2) + z * z, (1.0 - h).powi(2) + z * z);
    let ratio = (h - 1.0) / (h + 1.0);
    let sum = (z / (h * h - 1.0).sqrt()).atan()
        + z * (x - 2.0 * h) / (x * y).sqrt() * (x / y * ratio).sqrt().atan()
        - z * ratio.sqrt().atan();
    let shape = LightShape::Cylinder {
        radius: r,
        length: 2.0 * half_length,
    };
    let place = DMat4::from_translation(DVec3::new(0.0, height, 0.0));
    let irradiance = 2.0 * PI * radiance * sum / (PI * h);
    plane(bright(radiance, light(shape, place)), irradiance)
}

fn plane_distant() -> Known {
    let shape = LightShape::Distant {
        angle_degrees: 60.0,
    };
    let distant = light(shape, facing_down(0.0, 0.0, 0.0));
    plane(bright(4.0, distant), PI * 4.0 * FRAC_PI_6.sin().powi(2))
}

fn plane_dome() -> Known {
    let dome = light(LightShape::Dome, DMat4::IDENTITY);
    plane(bright(0.5, dome), PI * 0.5)
}

/// L = 1 − θ/π gives E = 2π ∫ (1 − θ/π) sin θ cos θ dθ = 3π/4 over the upper half.
fn brightening_dome() -> Known {
    let picture = TileFile::new([64, 2048], |_, y| [(y as f32 + 0.5) / 2048.0; 3]);
    let dome = Light {
        texture: Some(0),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    };
    let mut known = plane(dome, 0.75 * PI);
    known.stage.textures.push(picture.source());
    known.picture = Some(picture);
    known
}

/// Half of all rays meet a black roof.
fn half_a_roof() -> Known {
    let mut known = plane(light(LightShape::Dome, DMat4::IDENTITY), 0.5 * PI);
    known.stage.camera = orthographic([0.0, 0.05, 0.0], [0.0; 3], 5e-4);
    let roof = Mesh::floor(1e5).placed(DAffine3::from_translation(0.1 * DVec3::Y));
    known.stage.meshes.push(roof.with_material(1));
    let black = with_opacity(matte([0.0; 3]), 0.5);
    known.stage.materials.push(black);
    known
}

/// A white sphere in a white dome cannot be seen.
fn furnace_sphere() -> Known {
    let mut stage = Stage::new(perspective([0.0, 0.0, 5.0], [0.0; 3], 0.3));
    stage.materials.push(matte([1.0; 3]));
    stage.points.push(Points::new(&[[0.0; 3]], 2.0));
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    Known {
        stage,
        radiance: 1.0,
        max_depth: 4,
        picture: None,
    }
}

/// A box of albedo one half, with lights of radiance one half on its walls: ½ (1 + ½ + ¼ + …).
fn furnace_box() -> Known {
    let stage = Stage::box_of_light(matte([0.5; 3]));
    let max_depth = 16;
    Known {
        stage,
        radiance: 1.0 - 0.5_f64.powi(max_depth as i32 + 1),
        max_depth,
        picture: None,
    }
}
