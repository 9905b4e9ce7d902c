//! Instanced geometry is the same as geometry that was multiplied before.

use kilauea_math::{DAffine3, DMat4, DVec3};
use kilauea_mesh::PrimvarInterpolation;
use kilauea_scene::{Light, LightShape};
use kilauea_tests::{
    Mesh, MeshPrimvar, Picture, Placements, Stage, check_near, light, matte, matte_from_primvar,
    perspective, preview, rect_light, rel_mse,
};

fn base() -> Stage {
    let mut stage = Stage::new(perspective([0.0, 2.0, 4.0], [0.0, 0.3, 0.0], 0.5));
    stage.materials = vec![
        matte([0.7; 3]),
        preview(&[("diffuseColor", &[0.3, 0.5, 0.2]), ("roughness", &[0.4])]),
        matte_from_primvar("tint"),
    ];
    stage.meshes.push(Mesh::floor(3.0));
    stage.lights.push(rect_light(1.5, 1.5, 3.0));
    stage.lights.push(Light {
        radiance: kilauea_math::Spectrum::splat(0.3),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    });
    stage
}

fn render(stage: &Stage) -> Picture {
    stage.render(|s| {
        s.resolution = [48, 48];
        s.samples_per_pixel = 16;
    })
}

/// Shears, mirrors, stretches: nothing about these is nice.
fn placements() -> Vec<DAffine3> {
    let at = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    vec![
        at(-1.0, 0.31, 0.0) * DAffine3::from_scale(DVec3::splat(0.3)),
        at(0.2, 0.41, -0.5) * DAffine3::from_scale(DVec3::new(0.3, -0.4, 0.2)),
        at(1.2, 0.61, 0.3)
            * DAffine3::from_rotation_z(0.4)
            * DAffine3::from_scale(DVec3::new(0.1, 0.5, 0.25))
            * DAffine3::from_rotation_y(0.7),
    ]
}

/// Fails unless both pictures agree: the same surfaces in the same pixels, the same light.
fn check_same(instanced: &Picture, baked: &Picture, baked_prim_of_instance: impl Fn(i32) -> i32) {
    let ids = |picture: &Picture, name| -> Vec<i32> {
        picture.channel(name).iter().map(|&id| id as i32).collect()
    };
    let (instances, prims) = (ids(instanced, "instanceId"), ids(instanced, "primId"));
    let baked_prims = ids(baked, "primId");
    let mut n_seen = 0;
    for ((&instance, &prim), &baked_prim) in instances.iter().zip(&prims).zip(&baked_prims) {
        if instance >= 0 {
            n_seen += 1;
            assert_eq!(baked_prim_of_instance(instance), baked_prim);
        } else {
            assert_eq!(prim, baked_prim);
        }
    }
    assert!(n_seen > 100, "instances cover {n_seen} pixels");
    for name in ["N.X", "N.Y", "N.Z", "Z", "P.X", "albedo.G"] {
        let (a, b) = (instanced.channel(name), baked.channel(name));
        let pairs = a.iter().zip(b).filter(|(a, _)| a.is_finite());
        let difference = pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / a.len() as f64;
        assert!(difference < 1e-5, "{name}: mean difference {difference}");
    }
    // Rounding turns the frame around normals with z = ±0 by half, so some paths go elsewhere.
    for name in ["R", "G", "B"] {
        check_near(instanced.mean_of(name), baked.mean_of(name), 1e-3, name);
    }
    let error = rel_mse(instanced, baked);
    assert!(error < 1e-3, "relMSE {error}");
}

#[test]
fn instances_equal_baked_geometry() {
    let mut instanced = base();
    instanced.prototypes.push("/Prototype".into());
    instanced
        .meshes
        .push(Mesh::cube().with_material(1).in_prototype(1));
    instanced.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: placements(),
        primvar: None,
        later: Vec::new(),
    });
    let mut baked = base();
    for place in placements() {
        baked
            .meshes
            .push(Mesh::cube().with_material(1).placed(place));
    }
    check_same(&render(&instanced), &render(&baked), |instance| {
        1 + instance
    });
}

#[test]
fn nested_instances_equal_baked_geometry() {
    let pair = [-1.5, 1.5].map(|x| {
        DAffine3::from_translation(DVec3::new(x, 0.0, 0.3 * x))
            * DAffine3::from_scale(DVec3::new(0.8, 1.0, -1.0))
    });
    let mut nested = base();
    nested.prototypes.extend(["/Group".into(), "/Leaf".into()]);
    nested
        .meshes
        .push(Mesh::cube().with_material(1).in_prototype(2));
    for (parent, prototype, places) in [(0, 1, placements()), (1, 2, pair.to_vec())] {
        nested.instances.push(Placements {
            parent,
            prototype,
            parent_from_prototype: places,
            primvar: None,
            later: Vec::new(),
        });
    }
    let mut baked = base();
    for outer in placements() {
        for inner in pair {
            baked
                .meshes
                .push(Mesh::cube().with_material(1).placed(outer * inner));
        }
    }
    // Numbers count groups too: group, leaf, leaf, group, ...
    let leaf = |instance: i32| 1 + instance / 3 * 2 + (instance % 3 - 1);
    check_same(&render(&nested), &render(&baked), leaf);
}

#[test]
fn primvars_of_instances_stand_in_for_those_of_meshes() {
    let tints = [[0.9, 0.1, 0.2], [0.2, 0.8, 0.1], [0.1, 0.2, 0.7]];
    let tinted = |tint: [f32; 3]| {
        let mut cube = Mesh::cube().with_material(2);
        cube.primvars.push(MeshPrimvar {
            name: "tint".into(),
            interpolation: PrimvarInterpolation::Constant,
            values: tint.to_vec(),
        });
        cube
    };
    let mut instanced = base();
    instanced.prototypes.push("/Prototype".into());
    instanced.meshes.push(tinted([0.5; 3]).in_prototype(1));
    instanced.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: placements(),
        primvar: Some(("tint".into(), tints.concat())),
        later: Vec::new(),
    });
    let mut baked = base();
    for (place, tint) in placements().into_iter().zip(tints) {
        baked.meshes.push(tinted(tint).placed(place));
    }
    check_same(&render(&instanced), &render(&baked), |instance| {
        1 + instance
    });
}

/// The base scene with some instances, all of it transformed.
fn transformed(world_from_base: DAffine3, scale: f64) -> Stage {
    let mut stage = base();
    stage.prototypes.push("/Prototype".into());
    stage
        .meshes
        .push(Mesh::cube().with_material(1).in_prototype(1));
    stage.meshes[0].prototype_from_mesh = world_from_base;
    stage.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: placements()
            .into_iter()
            .map(|p| world_from_base * p)
            .collect(),
        primvar: None,
        later: Vec::new(),
    });
    let world_from_base = DMat4::from(world_from_base);
    for light in &mut stage.lights {
        light.world_from_light = world_from_base * light.world_from_light;
    }
    let camera = &mut stage.camera;
    camera.world_from_camera = world_from_base * camera.world_from_camera;
    camera.clipping_range = camera.clipping_range.map(|distance| distance * scale);
    stage
}

fn check_transform(world_from_base: DAffine3, scale: f64, what: &str) {
    let picture = render(&transformed(world_from_base, scale));
    let reference = render(&transformed(DAffine3::IDENTITY, 1.0));
    let error = rel_mse(&picture, &reference);
    // Rounding sends a few paths elsewhere.
    assert!(error < 1e-5, "{what}: relMSE {error}");
}

#[test]
fn far_from_the_origin_nothing_changes() {
    for offset in [DVec3::new(1e6, 0.0, 0.0), DVec3::new(-1e6, 1e6, 1e6)] {
        let place = DAffine3::from_translation(offset);
        check_transform(place, 1.0, &format!("moved by {offset}"));
    }
}

#[test]
fn at_any_scale_nothing_changes() {
    for scale in [1e-3, 0.1, 10.0, 1e4] {
        let place = DAffine3::from_scale(DVec3::splat(scale));
        check_transform(place, scale, &format!("scaled by {scale}"));
    }
}
