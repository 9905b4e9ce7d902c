//! The example of `docs/writing-shaders.md`, compiled and asked as a renderer would.

#![forbid(unsafe_code)]

/// The shader that the page shows.
pub mod checker;

use std::collections::BTreeMap;

use checker::Checker;
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_scene::{Attribute, Channel, Input, Interpolation, Material, MeshChunk, Node};
use kilauea_shading::{
    Element, ElementCounts, PrimvarLayout, ShaderInputs, Surface, SurfaceShader, TextureStore,
};

/// A material whose `st` is the primvar of that name.
fn material(constants: &[(&str, [f32; 4])]) -> Material {
    let mut nodes = vec![Node::Primvar {
        name: "st".into(),
        fallback: [0.0, 0.0, 0.0, 1.0],
    }];
    let mut inputs = BTreeMap::new();
    let input = |node| Input {
        node,
        channel: Channel::Rgb,
    };
    inputs.insert("st".to_owned(), input(0));
    for &(name, value) in constants {
        inputs.insert(name.to_owned(), input(nodes.len() as u32));
        nodes.push(Node::Constant { value });
    }
    Material {
        path: "/Looks/Tiles".into(),
        shader: Checker::NAME.into(),
        inputs,
        nodes,
    }
}

/// The albedo at a point of a triangle whose corners have `st` (0, 0), (1, 0) and (0, 1), so that
/// `barycentrics` are `st`.
fn albedo_at(material: &Material, barycentrics: Vec2) -> Spectrum {
    let mut inputs = ShaderInputs::new(material);
    let shader = Checker::compile(&mut inputs).expect("inputs of the right kind");
    let summary = inputs.finish();
    assert!(summary.ignored.is_empty(), "{:?}", summary.ignored);

    let chunk = MeshChunk {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        attributes: vec![Attribute {
            name: "st".into(),
            width: 2,
            interpolation: Interpolation::Vertex,
            data: vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
        }],
        ..MeshChunk::default()
    };
    let (textures, _) = TextureStore::open(&[], 0);
    let surface = Surface {
        p: barycentrics.extend(0.0),
        ng: Vec3::Z,
        ns: Vec3::Z,
        wo: Vec3::Z,
        corners: chunk.corners(0),
        barycentrics,
        attributes: &chunk.attributes,
        element: Element::triangle(&chunk, 0),
        primvars: &PrimvarLayout::resolve(
            &summary.primvars,
            &chunk.attributes,
            ElementCounts::from(&chunk),
            &[],
        ),
        instance_primvars: &[],
        instance_index: 0,
        outside_ior: 1.0,
        footprint: 0.0,
        textures: &textures,
    };
    let bsdf = shader.bsdf(&surface);
    let sample = bsdf.sample(Vec3::Z, [0.5, 0.3, 0.7]).expect("a direction");
    let found = bsdf.albedo(Vec3::Z);
    assert!((sample.weight() - found).max_channel().abs() < 1e-6);
    found
}

#[test]
fn neighbouring_squares_differ() {
    let tiles = material(&[
        ("frequency", [2.0, 0.0, 0.0, 1.0]),
        ("even", [0.9, 0.8, 0.7, 1.0]),
        ("odd", [0.2, 0.1, 0.0, 1.0]),
    ]);
    let (even, odd) = (Spectrum::new(0.9, 0.8, 0.7), Spectrum::new(0.2, 0.1, 0.0));
    for (st, expected) in [
        ([0.25, 0.25], even),
        ([0.6, 0.25], odd),
        ([0.25, 0.6], odd),
        ([0.51, 0.49], odd),
        ([0.0, 0.99], odd),
    ] {
        assert_eq!(albedo_at(&tiles, Vec2::from_array(st)), expected, "{st:?}");
    }
}

#[test]
fn declared_defaults_hold_where_nothing_is_authored() {
    assert_eq!(
        albedo_at(&material(&[]), Vec2::splat(0.01)),
        Spectrum::splat(0.8)
    );
    let names: Vec<_> = Checker::declaration()
        .parameters
        .iter()
        .map(|p| p.name)
        .collect();
    assert_eq!(names, ["even", "odd", "st", "frequency"]);
}
