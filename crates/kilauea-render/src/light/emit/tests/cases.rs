//! A scene for each kind of light.

use kilauea_math::{DVec3, Vec3};
use kilauea_scene::{
    Camera, Light, LightShape, Material, MeshChunk, Prototype, Scene, TextureSource,
};
use std::f32::consts::PI;

use crate::light::Emitter;
use crate::statistics::lights::{
    CYLINDER, DISK, RECT, SPHERE, light, scaled, shaping, shear, sunny, turned,
};
use crate::statistics::lit::glowing;
use crate::{PrepareOptions, PreparedScene};

/// A scene of one light and, off it, a block that is lit.
pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) prepared: PreparedScene,
    /// Watts in each channel, where there is a formula.
    pub(super) flux: Option<f64>,
}

impl Case {
    /// Whether rays start within a radius of one, and not all around the block.
    pub(super) fn is_small(&self) -> bool {
        self.prepared.lights.infinite.is_empty()
    }
}

/// A block between these corners.
pub(super) const BLOCK: [Vec3; 2] = [Vec3::new(-1.0, -2.5, -3.0), Vec3::new(2.0, -1.5, 1.0)];

fn case(name: &'static str, lights: Vec<Light>, flux: impl Into<Option<f64>>) -> Case {
    Case {
        name,
        prepared: prepare(lights, &block(), "Matte", Vec::new()),
        flux: flux.into(),
    }
}

pub(super) fn prepare(
    lights: Vec<Light>,
    triangles: &[[Vec3; 3]],
    shader: &str,
    textures: Vec<TextureSource>,
) -> PreparedScene {
    let matte = Material {
        path: "/Material".into(),
        shader: shader.into(),
        ..glowing()
    };
    let chunk = MeshChunk {
        positions: triangles.iter().flatten().map(Vec3::to_array).collect(),
        triangles: (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        ..MeshChunk::default()
    };
    let scene = Scene {
        origin_world: DVec3::ZERO,
        prim_paths: vec!["/Mesh".into()],
        prototypes: vec![Prototype {
            chunks: vec![chunk],
            ..Prototype::default()
        }],
        materials: vec![matte],
        textures,
        lights,
        camera: Camera::default(),
    };
    PreparedScene::new(scene, &PrepareOptions::default()).expect("the scene is sound")
}

/// Two triangles that span a block.
pub(super) fn block() -> Vec<[Vec3; 3]> {
    let [min, max] = BLOCK;
    let corner = |x: f32, y: f32, z: f32| min + (max - min) * Vec3::new(x, y, z);
    vec![
        [
            corner(0.0, 0.0, 0.0),
            corner(1.0, 0.0, 0.0),
            corner(0.0, 0.0, 1.0),
        ],
        [
            corner(1.0, 1.0, 1.0),
            corner(0.0, 1.0, 1.0),
            corner(1.0, 1.0, 0.0),
        ],
    ]
}

pub(super) fn cases() -> Vec<Case> {
    let shear = shear();
    let (rect, disk, sphere, cylinder) = (RECT, DISK, SPHERE, CYLINDER);
    let distant = |angle_degrees| LightShape::Distant { angle_degrees };
    let shaped = |shape, place| Light {
        shaping: Some(shaping()),
        ..light(shape, place)
    };
    let pi = f64::from(PI);
    // Sheared, 1.2 x 0.7 is spanned by vectors with a cross product of length 1.08 times that.
    let mut cases = vec![
        case("rect", vec![light(rect, turned())], pi * 0.84),
        case(
            "sheared rect",
            vec![light(rect, turned() * shear)],
            pi * 0.84 * 1.08,
        ),
        case("disk", vec![light(disk, turned())], pi * pi * 0.25),
        case(
            "ellipse",
            vec![light(disk, scaled(1.2, 0.5, 2.0))],
            pi * pi * 0.25 * 0.6,
        ),
        case("sphere", vec![light(sphere, turned())], pi * pi),
        case(
            "ellipsoid",
            vec![light(sphere, scaled(1.2, 0.4, 0.8))],
            None,
        ),
        case(
            "cylinder",
            vec![light(cylinder, turned())],
            pi * 2.0 * pi * 0.15 * 1.4,
        ),
        case(
            "flat cylinder",
            vec![light(cylinder, scaled(1.0, 3.0, 0.5))],
            None,
        ),
        case("sun", vec![light(distant(0.53), turned())], None),
        case("parallel", vec![light(distant(0.0), turned())], None),
        case("wide distant", vec![light(distant(50.0), turned())], None),
        case("dome", vec![light(LightShape::Dome, turned())], None),
        case("shaped sphere", vec![shaped(sphere, turned())], None),
        case("shaped disk", vec![shaped(disk, turned())], None),
        case(
            "shaped sheared rect",
            vec![shaped(rect, turned() * shear)],
            None,
        ),
    ];

    let sunny = sunny();
    for (name, shape) in [
        ("dome with a sun", LightShape::Dome),
        ("pictured rect", rect),
    ] {
        let light = Light {
            texture: Some(0),
            ..light(shape, turned())
        };
        cases.push(Case {
            name,
            prepared: prepare(vec![light], &block(), "Matte", vec![sunny.source()]),
            flux: None,
        });
    }
    let corner = |x, y, z| turned().transform_point3(DVec3::new(x, y, z)).as_vec3();
    let triangle = [
        corner(-0.6, -0.3, 0.1),
        corner(0.5, -0.4, -0.1),
        corner(0.1, 0.6, 0.0),
    ];
    let area = 0.5
        * (triangle[1] - triangle[0])
            .cross(triangle[2] - triangle[0])
            .length();
    cases.push(Case {
        name: "triangle",
        prepared: prepare(Vec::new(), &[triangle], "UsdPreviewSurface", Vec::new()),
        flux: Some(2.0 * pi * f64::from(area)),
    });
    cases
}

pub(super) fn emitter(prepared: &PreparedScene) -> Emitter<'_> {
    Emitter::new(&prepared.lights, &prepared.geometry, &prepared.textures)
}
