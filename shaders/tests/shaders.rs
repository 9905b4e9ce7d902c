//! Shaders as a renderer uses them: compiled from a material, asked at a surface.

#![forbid(unsafe_code)]

use std::collections::BTreeMap;

use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_scene::{Channel, Input, Material, MeshChunk, Node, Wrap};
use kilauea_shading::{Element, ElementCounts, PrimvarLayout, PrimvarSlot, Surface, TextureStore};
use shaders::Shader;

/// A material whose inputs are constants.
fn material(shader: &str, inputs: &[(&str, [f32; 3])]) -> Material {
    let mut material = Material {
        path: "/Looks/Test".into(),
        shader: shader.into(),
        inputs: BTreeMap::new(),
        nodes: Vec::new(),
    };
    for &(name, [r, g, b]) in inputs {
        let value = [r, g, b, 1.0];
        connect(&mut material, name, Node::Constant { value });
    }
    material
}

fn connect(material: &mut Material, name: &str, node: Node) {
    let input = Input {
        node: material.nodes.len() as u32,
        channel: Channel::Rgb,
    };
    material.nodes.push(node);
    material.inputs.insert(name.into(), input);
}

fn compile(shader: &str, inputs: &[(&str, [f32; 3])]) -> Shader {
    Shader::compile(&material(shader, inputs)).unwrap_or_else(|error| panic!("{error}"))
}

/// A triangle facing up.
fn chunk() -> MeshChunk {
    MeshChunk {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..MeshChunk::default()
    }
}

fn primvar_slots(shader: &Shader, chunk: &MeshChunk) -> Vec<PrimvarSlot> {
    let counts = ElementCounts::from(chunk);
    PrimvarLayout::resolve(shader.primvars(), &chunk.attributes, counts, &[])
}

fn with_surface<T>(shader: &Shader, wo: Vec3, ask: impl FnOnce(&Surface<'_>) -> T) -> T {
    let chunk = chunk();
    let primvars = primvar_slots(shader, &chunk);
    let (textures, _) = TextureStore::open(&[], 0);
    ask(&Surface {
        p: Vec3::new(0.25, 0.25, 0.0),
        ng: Vec3::Z,
        ns: Vec3::Z,
        wo,
        corners: chunk.corners(0),
        barycentrics: Vec2::splat(0.25),
        attributes: &chunk.attributes,
        element: Element::triangle(&chunk, 0),
        primvars: &primvars,
        instance_primvars: &[],
        instance_index: 0,
        outside_ior: 1.0,
        footprint: 0.0,
        textures: &textures,
    })
}

fn wo_at(cos: f32) -> Vec3 {
    Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
}

/// What a shader reflects and refracts of a white environment.
fn furnace(shader: &Shader, wo: Vec3) -> Spectrum {
    const N: u32 = 20_000;
    with_surface(shader, wo, |surface| {
        let bsdf = shader.bsdf(surface);
        (0..N)
            .filter_map(|i| bsdf.sample(wo, [0, 1, 2].map(|k| unit_f32(combine(i, k)))))
            .map(|s| s.weight())
            .sum::<Spectrum>()
            / N as f32
    })
}

const WHITE: (&str, [f32; 3]) = ("diffuseColor", [1.0; 3]);

fn scalar(name: &str, value: f32) -> (&str, [f32; 3]) {
    (name, [value, 0.0, 0.0])
}

#[test]
fn mirror_reflects_its_tint() {
    let tint = [0.9, 0.5, 0.0];
    let mirror = compile("Mirror", &[("tint", tint)]);
    with_surface(&mirror, wo_at(0.3), |surface| {
        let sample = mirror.bsdf(surface).sample(wo_at(0.3), [0.5; 3]).unwrap();
        let reflected = wo_at(0.3) * Vec3::new(-1.0, 1.0, 1.0);
        assert!(sample.is_delta && sample.wi.distance(reflected) < 1e-6);
        assert!((sample.weight() - Spectrum::from(tint)).max_channel().abs() < 1e-6);
    });
}

#[test]
fn brushed_mirror_is_reciprocal_up_to_what_facets_return() {
    // Compensation depends on one direction alone; at this roughness it is below a percent.
    let mirror = compile("Mirror", &[("tint", [0.8; 3]), scalar("roughness", 0.3)]);
    let (a, b) = (wo_at(0.6), Vec3::new(-0.6, 0.2, 0.6_f32.sqrt()).normalize());
    with_surface(&mirror, a, |surface| {
        let bsdf = mirror.bsdf(surface);
        let (there, back) = (bsdf.eval(a, b).total()[0], bsdf.eval(b, a).total()[0]);
        let (there, back) = (there * a.z, back * b.z);
        assert!(
            there > 0.0 && (there - back).abs() < 0.01 * there,
            "{there} {back}"
        );
    });
}

#[test]
fn glass_tints_what_it_refracts_and_not_what_it_reflects() {
    let tint = Spectrum::new(0.9, 0.5, 0.0);
    let glass = compile("Glass", &[("tint", tint.to_array()), scalar("ior", 1.5)]);
    let clear = compile("Glass", &[scalar("ior", 1.5)]);
    for wo in [wo_at(0.6), -wo_at(0.9)] {
        let reflected = 1.0 - refracted_share(&clear, wo);
        let found = furnace(&glass, wo);
        let expected = Spectrum::ONE * reflected + tint * (1.0 - reflected);
        for c in 0..3 {
            assert!(
                (found[c] - expected[c]).abs() < 0.015,
                "{wo}: {found:?}, {expected:?}"
            );
        }
    }
}

#[test]
fn refraction_there_and_back_loses_alike() {
    // Basic radiance makes the smooth boundary reciprocal: the share that passes is the same
    // from either end of a refracted path.
    let glass = compile("Glass", &[scalar("ior", 1.33)]);
    let wo = wo_at(0.4);
    let inside = with_surface(&glass, wo, |surface| {
        let sample = glass.bsdf(surface).sample(wo, [0.999, 0.5, 0.5]).unwrap();
        assert!(sample.is_transmission);
        sample.wi
    });
    let difference = refracted_share(&glass, wo) - refracted_share(&glass, inside);
    assert!(difference.abs() < 0.01, "{difference}");
}

/// What passes of a white environment.
fn refracted_share(shader: &Shader, wo: Vec3) -> f32 {
    const N: u32 = 20_000;
    with_surface(shader, wo, |surface| {
        let bsdf = shader.bsdf(surface);
        (0..N)
            .filter_map(|i| bsdf.sample(wo, [unit_f32(combine(i, 0)), 0.5, 0.5]))
            .filter(|s| s.is_transmission)
            .map(|s| s.weight()[0])
            .sum::<f32>()
            / N as f32
    })
}

#[test]
fn nonsense_gives_no_nan() {
    for (name, inputs) in [
        (
            "Mirror",
            [("tint", [9.0, -1.0, 0.5]), scalar("roughness", -3.0)],
        ),
        ("Glass", [("tint", [9.0, -1.0, 0.5]), scalar("ior", -2.0)]),
        ("Glass", [("tint", [0.0; 3]), scalar("ior", 1e30)]),
    ] {
        let shader = compile(name, &inputs);
        let found = furnace(&shader, wo_at(0.2));
        assert!(
            found.is_finite() && found.max_channel() <= 1.015,
            "{name}: {found:?}"
        );
        assert!(!shader.out_of_range().is_empty());
    }
}

#[test]
fn partial_metals_lose_light_as_the_specification_has_it_and_gain_none() {
    // The diffuse part is scaled by 1 - metallic and again by what a half metallic interface
    // leaves.
    for opacity in [1.0, 0.4] {
        let inputs = [WHITE, scalar("metallic", 0.5), scalar("opacity", opacity)];
        let found = furnace(&compile("UsdPreviewSurface", &inputs), wo_at(0.7))[0];
        assert!((0.7..0.99).contains(&found), "{found}");
    }
}

#[test]
fn metal_has_its_color() {
    let color = [0.8, 0.4, 0.1];
    let gold = compile(
        "UsdPreviewSurface",
        &[
            ("diffuseColor", color),
            scalar("metallic", 1.0),
            scalar("roughness", 0.0),
        ],
    );
    let found = furnace(&gold, wo_at(1.0));
    let difference = found - Spectrum::from(color);
    assert!(
        difference.to_array().iter().all(|d| d.abs() < 1e-3),
        "{found:?}"
    );
}

#[test]
fn glass_is_a_smooth_dielectric() {
    let shader = compile(
        "UsdPreviewSurface",
        &[
            scalar("opacity", 0.0),
            scalar("roughness", 0.0),
            scalar("ior", 1.33),
        ],
    );
    let wo = wo_at(0.5);
    with_surface(&shader, wo, |surface| {
        let bsdf = shader.bsdf(surface);
        assert!(!bsdf.has_smooth_lobes());
        let refracted = bsdf.sample(wo, [0.999, 0.5, 0.5]).unwrap();
        assert!(refracted.is_transmission);
        assert!((refracted.wi.x + wo.x / 1.33).abs() < 1e-5, "{refracted:?}");
    });
    assert!(shader.is_opaque());
}

#[test]
fn opacity_modes() {
    let presence = |inputs: &[(&str, [f32; 3])]| {
        let shader = compile("UsdPreviewSurface", inputs);
        let opacity = with_surface(&shader, Vec3::Z, |s| shader.opacity(s));
        assert_eq!(shader.is_opaque(), opacity == 1.0, "{inputs:?}");
        opacity
    };
    let opacity = scalar("opacity", 0.4);
    assert_eq!(presence(&[]), 1.0);
    assert_eq!(presence(&[opacity]), 1.0);
    assert_eq!(presence(&[opacity, scalar("opacityMode", 1.0)]), 0.4);
    // The threshold overrides the mode.
    for mode in [0.0, 1.0] {
        let mode = scalar("opacityMode", mode);
        assert_eq!(
            presence(&[opacity, mode, scalar("opacityThreshold", 0.5)]),
            0.0
        );
        assert_eq!(
            presence(&[opacity, mode, scalar("opacityThreshold", 0.4)]),
            1.0
        );
    }
    // What is there is not glass.
    let cutout = compile(
        "UsdPreviewSurface",
        &[opacity, scalar("opacityThreshold", 0.1)],
    );
    with_surface(&cutout, Vec3::Z, |s| {
        let bsdf = cutout.bsdf(s);
        for i in 0..200 {
            let sample = bsdf.sample(Vec3::Z, [i as f32 / 200.0, 0.3, 0.6]);
            assert!(sample.is_none_or(|s| !s.is_transmission));
        }
    });
    let matte = compile("Matte", &[scalar("opacity", 0.25)]);
    assert_eq!(with_surface(&matte, Vec3::Z, |s| matte.opacity(s)), 0.25);
    assert!(!matte.is_opaque());
}

#[test]
fn unknown_opacity_mode_is_an_error() {
    let material = material("UsdPreviewSurface", &[scalar("opacityMode", 2.0)]);
    let error = Shader::compile(&material).unwrap_err().to_string();
    assert!(
        error.contains("/Looks/Test") && error.contains("opacityMode"),
        "{error}"
    );
}

#[test]
fn emission_is_seen_from_both_sides() {
    let lamp = compile("UsdPreviewSurface", &[("emissiveColor", [3.0, 2.0, 1.0])]);
    assert!(lamp.is_emissive());
    for wo in [Vec3::Z, -Vec3::Z] {
        let emission = with_surface(&lamp, wo, |s| lamp.emission(s));
        assert_eq!(emission, Spectrum::new(3.0, 2.0, 1.0));
    }
    let (textures, _) = TextureStore::open(&[], 0);
    assert_eq!(lamp.mean_emission(&textures), Spectrum::new(3.0, 2.0, 1.0));
    let dark = compile("UsdPreviewSurface", &[]);
    assert!(!dark.is_emissive() && dark.mean_emission(&textures).is_black());
}

#[test]
fn emission_by_primvar_has_some_mean() {
    let mut material = material("UsdPreviewSurface", &[]);
    let fallback = [0.0; 4];
    let name = "glow".into();
    connect(
        &mut material,
        "emissiveColor",
        Node::Primvar { name, fallback },
    );
    let shader = Shader::compile(&material).unwrap();
    assert_eq!(shader.primvars(), ["glow"]);
    let (textures, _) = TextureStore::open(&[], 0);
    assert!(shader.is_emissive() && !shader.mean_emission(&textures).is_black());
}

#[test]
fn normal_map_turns_the_mirror() {
    // A missing image: its fallback, scaled and biased, is the normal (0.6, 0, 0.8) in tangent
    // space. Its st is a primvar that the mesh does not have, so no tangents: no effect.
    let mut chunk = chunk();
    let mut mirror = material(
        "UsdPreviewSurface",
        &[WHITE, scalar("metallic", 1.0), scalar("roughness", 0.0)],
    );
    let st = mirror.nodes.len() as u32;
    mirror.nodes.push(Node::Primvar {
        name: "st".into(),
        fallback: [0.0; 4],
    });
    let map = Node::UvTexture {
        texture: 0,
        st,
        wrap_s: Wrap::Repeat,
        wrap_t: Wrap::Repeat,
        scale: [2.0, 2.0, 2.0, 1.0],
        bias: [-1.0, -1.0, -1.0, 0.0],
        fallback: [0.8, 0.5, 0.9, 1.0],
    };
    connect(&mut mirror, "normal", map);
    let shader = Shader::compile(&mirror).unwrap();
    let reflected = |chunk: &MeshChunk| {
        let primvars = primvar_slots(&shader, chunk);
        with_surface(&shader, Vec3::Z, |flat| {
            let surface = Surface {
                attributes: &chunk.attributes,
                primvars: &primvars,
                ..*flat
            };
            shader.bsdf(&surface).sample(Vec3::Z, [0.5; 3]).unwrap().wi
        })
    };
    assert!(reflected(&chunk).distance(Vec3::Z) < 1e-5);
    chunk.attributes.push(kilauea_scene::Attribute {
        name: "st".into(),
        width: 2,
        interpolation: kilauea_scene::Interpolation::Vertex,
        data: vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
    });
    // The mirror direction of z about (0.6, 0, 0.8).
    let found = reflected(&chunk);
    assert!(found.distance(Vec3::new(0.96, 0.0, 0.28)) < 1e-5, "{found}");
}

#[test]
fn glass_in_its_like_is_not_there() {
    let shader = compile("Glass", &[scalar("ior", 1.33)]);
    let wo = wo_at(0.4);
    with_surface(&shader, wo, |air| {
        let water = Surface {
            outside_ior: 1.33,
            ..*air
        };
        for u in [0.01, 0.5, 0.99] {
            let sample = shader.bsdf(&water).sample(wo, [u, 0.5, 0.5]).unwrap();
            assert!(sample.is_transmission && sample.wi.distance(-wo) < 1e-5);
        }
        let first = shader.bsdf(air).sample(wo, [0.0, 0.5, 0.5]).unwrap();
        assert!(!first.is_transmission || first.wi.distance(-wo) > 0.1);
    });
}

#[test]
fn glass_says_what_is_inside() {
    let inputs = [
        scalar("ior", 20.0),
        scalar("priority", -3.0),
        ("transmissionColor", [1.0, 0.25, 0.0]),
        scalar("transmissionDepth", 0.5),
    ];
    let shader = compile("Glass", &inputs);
    let inside = shader.interior().unwrap();
    // As declared, no index is above 10.
    assert_eq!((inside.ior, inside.priority), (10.0, -3));
    let [r, g, b] = inside.transmittance(0.5).to_array();
    assert!(r == 1.0 && (g - 0.25).abs() < 1e-6 && b < 1e-30);
    for shader in ["Matte", "Mirror", "UsdPreviewSurface"] {
        assert_eq!(compile(shader, &[]).interior(), None);
    }
}

#[test]
fn unknown_shader_names_the_material() {
    let error = Shader::compile(&material("Velvet", &[]))
        .unwrap_err()
        .to_string();
    for part in ["/Looks/Test", "Velvet", "Matte", "UsdPreviewSurface"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn inputs_that_a_shader_does_not_have_are_reported() {
    let shader = compile("Matte", &[("albedo", [0.5; 3]), scalar("sheen", 1.0)]);
    assert_eq!(shader.ignored_inputs(), ["sheen"]);
}

#[test]
fn defaults_are_those_of_the_specification() {
    let declarations = Shader::declarations();
    let (_, preview) = declarations
        .iter()
        .find(|(name, _)| *name == "UsdPreviewSurface")
        .unwrap();
    let preview = &preview.parameters;
    let default = |name: &str| preview.iter().find(|p| p.name == name).unwrap().default[0];
    assert_eq!(preview.len(), 15);
    for (name, value) in [
        ("diffuseColor", 0.18),
        ("roughness", 0.5),
        ("clearcoatRoughness", 0.01),
        ("opacity", 1.0),
        ("ior", 1.5),
    ] {
        assert_eq!(default(name), value, "{name}");
    }
}
