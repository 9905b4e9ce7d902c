//! Whatever paths believe of the light, they find the same.

use std::sync::Arc;

use kilauea_gather::{
    Arrival, ChoiceField, ChoiceRecords, GatherField, GatherRecord, PictureEstimate,
};
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{DMat4, DVec3, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::{
    Camera, Channel, FilterKind, Input, Light, LightShape, Material, MeshChunk, Node, Prototype,
    RenderSettings, Scene, Visibility,
};
use kilauea_testing::{Family, Moments, welch_p};

use super::trainer::Trainer;
use crate::conditions::Conditions;
use crate::frame::Frame;
use crate::integrator::{Guide, Guided, Media, MediumStack, Notes, Unguided};
use crate::statistics::lights::{RECT, SPHERE, light};

use crate::{PrepareOptions, PreparedScene};

const N_SEEDS: u32 = 16;
const SIDE: u32 = 8;
const NOTES: Notes = Notes {
    directions: true,
    lights: true,
};
/// Pixels on the side of a tile, whose mean is nearly normal.
const TILE: u32 = 4;
const N_TILES: usize = ((SIDE / TILE) * (SIDE / TILE)) as usize;

/// A room that is open toward the camera, half matte and half glossy, under a light that shines on
/// its ceiling: most light is reflected more than once.
fn room() -> Scene {
    let upward = DMat4::from_translation(DVec3::new(0.3, 0.2, -2.0))
        * DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let lamp = Light {
        specular: 1.0,
        ..light(RECT, upward)
    };
    room_with(vec![lamp], 0.0)
}

/// The same room with lights of all kinds: some are in it, one behind a wall, one is the sky, and its
/// walls shine.
fn room_of_many_lights() -> Scene {
    let at = |x, y, z| DMat4::from_translation(DVec3::new(x, y, z));
    let small = DMat4::from_scale(DVec3::splat(0.3));
    let lights = vec![
        light(RECT, at(0.2, 0.9, -2.0)),
        light(SPHERE, at(-0.5, -0.4, -2.2) * small),
        light(SPHERE, at(3.0, 0.0, -2.0)),
        Light {
            radiance: Spectrum::splat(0.1),
            ..light(LightShape::Dome, DMat4::IDENTITY)
        },
    ];
    room_with(lights, 0.05)
}

fn room_with(lights: Vec<Light>, emission: f32) -> Scene {
    // x, y and z by a bit each.
    let corner = |bits: u8| {
        let [x, y, z] = [0, 1, 2].map(|axis| f32::from(bits >> axis & 1));
        [2.0 * x - 1.0, 2.0 * y - 1.0, 2.0 * z - 3.0]
    };
    let floor_and_ceiling = [[0, 1, 5, 4], [2, 3, 7, 6]];
    let walls = [[0, 1, 3, 2], [0, 2, 6, 4], [1, 3, 7, 5]];
    let chunk = |(material, quads): (u32, &[[u8; 4]])| MeshChunk {
        material,
        positions: quads.concat().into_iter().map(corner).collect(),
        triangles: (0..quads.len() as u32)
            .flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| 4 * i + v)))
            .collect(),
        visibility: Visibility::ALL,
        ..MeshChunk::default()
    };
    Scene {
        origin_world: DVec3::ZERO,
        prim_paths: vec!["/Room".into()],
        prototypes: vec![Prototype {
            chunks: [(0, &floor_and_ceiling[..]), (1, &walls[..])]
                .map(chunk)
                .into(),
            ..Prototype::default()
        }],
        materials: vec![
            preview([0.8, 0.7, 0.6], 1.0, 0.0),
            preview([0.5, 0.6, 0.7], 0.3, emission),
        ],
        textures: Vec::new(),
        lights,
        camera: Camera {
            screen_window: [-0.7, -0.7, 0.7, 0.7],
            ..Camera::default()
        },
    }
}

fn preview(diffuse: [f32; 3], roughness: f32, emission: f32) -> Material {
    let [r, g, b] = diffuse;
    let input = |node, channel| Input { node, channel };
    let constant = |value| Node::Constant { value };
    Material {
        path: "/Material".into(),
        shader: "UsdPreviewSurface".into(),
        inputs: [
            ("diffuseColor".into(), input(0, Channel::Rgb)),
            ("roughness".into(), input(1, Channel::R)),
            ("emissiveColor".into(), input(2, Channel::Rgb)),
        ]
        .into(),
        nodes: vec![
            constant([r, g, b, 1.0]),
            constant([roughness; 4]),
            constant([emission; 4]),
        ],
    }
}

fn settings(seed: u32) -> RenderSettings {
    RenderSettings {
        resolution: [SIDE; 2],
        samples_per_pixel: 32,
        max_depth: 5,
        seed,
        filter: FilterKind::Box,
        threads: 1,
        aovs: vec!["Z".into()],
        general: vec!["guided_directions".into()],
        ..RenderSettings::default()
    }
}

fn frame(prepared: &Arc<PreparedScene>, seed: u32) -> Frame {
    let prepared = Arc::clone(prepared);
    Frame::new(Conditions::default(), prepared, settings(seed)).expect("the settings are sound")
}

/// Means of the tiles of a picture that paths with a guide make.
fn tile_means(prepared: &Arc<PreparedScene>, seed: u32, guide: impl Guide) -> [f64; N_TILES] {
    let frame = frame(prepared, seed);
    frame
        .run_all::<true, _, _>(MediumStack::AIR, guide)
        .expect("no shader panics");
    let image = frame.film.to_image(DVec3::ZERO);
    let mut means = [0.0; N_TILES];
    for name in ["R", "G", "B"] {
        let channel = image.channel(name).expect("beauty is always there");
        for (idx, &value) in (0..).zip(channel) {
            let (column, row) = (idx % SIDE / TILE, idx / SIDE / TILE);
            means[(row * (SIDE / TILE) + column) as usize] += f64::from(value);
        }
    }
    means
}

/// Moments over seeds of each tile.
fn moments(prepared: &Arc<PreparedScene>, first_seed: u32, guide: impl Guide) -> Vec<Moments> {
    let pictures: Vec<_> = (first_seed..first_seed + N_SEEDS)
        .map(|seed| tile_means(prepared, seed, guide))
        .collect();
    let of_tile = |tile| Moments::of(&pictures.iter().map(|p| p[tile]).collect::<Vec<_>>());
    (0..N_TILES).map(of_tile).collect()
}

/// What is wrong in records, by their numbers.
type Spoil = fn(u32, GatherRecord) -> GatherRecord;

const SPOILED: [(&str, Spoil); 4] = [
    ("sound", |_, record| record),
    ("nothing", |_, record| {
        arrived(record, record.arrival.wi, 0.0)
    }),
    ("any light", |i, record| {
        arrived(record, record.arrival.wi, number(i, 3).powi(4))
    }),
    ("any direction", |i, record| {
        let wi = warp::uniform_sphere(Vec2::new(number(i, 1), number(i, 2)));
        arrived(record, wi, number(i, 3).powi(4))
    }),
];

fn arrived(record: GatherRecord, wi: Vec3, irradiance: f32) -> GatherRecord {
    GatherRecord {
        arrival: Arrival {
            wi,
            irradiance,
            ..record.arrival
        },
        ..record
    }
}

fn number(i: u32, what: u32) -> f32 {
    unit_f32(combine(i, what))
}

#[test]
fn spoiled_guides_change_no_expectation() {
    let prepared = PreparedScene::new(room(), &PrepareOptions::default());
    let prepared = Arc::new(prepared.expect("the scene is sound"));
    let trained = frame(&prepared, 500);
    let integrator = trained.integrator::<true, _>(MediumStack::AIR);
    let tracer = trained.tracer();
    let mut trainer = Trainer::new(&trained, integrator, &tracer).expect("it is told to train");
    trainer
        .run(16.0 * trainer.pilot_paths, None, NOTES)
        .expect("no shader panics");

    let expected = moments(&prepared, 1000, Unguided);
    let mut family = Family::new("guides");
    for (seed, (what, spoil)) in (1..).zip(SPOILED) {
        let records: Vec<_> = (0..)
            .zip(&trainer.records)
            .map(|(i, r)| spoil(i, *r))
            .collect();
        let field = GatherField::fit(&records).expect("there are records");
        let found = moments(&prepared, 2000 * seed, Guided::by_directions(&field));
        for (tile, (a, b)) in expected.iter().zip(&found).enumerate() {
            let p = welch_p(a, b, 3e-5 * a.mean);
            family.add(format!("{what}, tile {tile}"), p);
        }
    }
    family.check();
}

/// What is wrong in what lights are said to have brought, by the numbers of records.
type SpoilChoice = fn(u32, f32) -> f32;

const SPOILED_CHOICES: [(&str, SpoilChoice); 3] = [
    ("sound", |_, brought| brought),
    ("the contrary", |_, brought| {
        f32::from(u8::from(brought == 0.0))
    }),
    ("anything", |i, _| f32::from(u8::from(number(i, 3) < 0.2))),
];

fn spoiled(choices: &ChoiceRecords, spoil: SpoilChoice) -> ChoiceRecords {
    let mut spoiled = ChoiceRecords::default();
    for (i, record) in (0..).zip(choices.iter()) {
        let (place, turns) = ([record.p, record.n], choices.turns(record));
        spoiled.push(place, record.pixel, turns);
        spoiled.set_last_brought(spoil(i, record.brought));
    }
    spoiled
}

#[test]
fn spoiled_choices_of_lights_change_no_expectation() {
    let prepared = PreparedScene::new(room_of_many_lights(), &PrepareOptions::default());
    let prepared = Arc::new(prepared.expect("the scene is sound"));
    let trained = frame(&prepared, 500);
    let integrator = trained.integrator::<true, _>(MediumStack::AIR);
    let tracer = trained.tracer();
    let mut trainer = Trainer::new(&trained, integrator, &tracer).expect("it is told to train");
    let samples = trainer
        .run(4.0 * trainer.pilot_paths, None, NOTES)
        .expect("no shader panics");
    let picture = PictureEstimate::fit([0; 2], [SIDE as i32; 2], &samples).expect("there is light");

    let expected = moments(&prepared, 1000, Unguided);
    let mut family = Family::new("choices of lights");
    for (seed, (what, spoil)) in (1..).zip(SPOILED_CHOICES) {
        let choices = spoiled(&trainer.choices, spoil);
        let field = ChoiceField::fit(&choices, &picture).expect("there are choices");
        let found = moments(&prepared, 2000 * seed, Guided::by_lights(&field));
        for (tile, (a, b)) in expected.iter().zip(&found).enumerate() {
            let p = welch_p(a, b, 3e-5 * a.mean);
            family.add(format!("{what}, tile {tile}"), p);
        }
    }
    family.check();
}
