use kilauea_scene::{Channel, Input, Material, Node};

fn material(shader: &str, nodes: Vec<(&str, Channel, Node)>) -> Material {
    let inputs = nodes.iter().enumerate().map(|(idx, (name, channel, _))| {
        let input = Input {
            node: idx as u32,
            channel: *channel,
        };
        ((*name).to_owned(), input)
    });
    Material {
        path: "/Material".into(),
        shader: shader.into(),
        inputs: inputs.collect(),
        nodes: nodes.into_iter().map(|(_, _, node)| node).collect(),
    }
}

fn constant(values: &[f32]) -> (Channel, Node) {
    let mut value = [0.0, 0.0, 0.0, 1.0];
    value[..values.len()].copy_from_slice(values);
    let channel = if values.len() == 1 {
        Channel::R
    } else {
        Channel::Rgb
    };
    (channel, Node::Constant { value })
}

/// An ideal diffuse surface.
pub fn matte(albedo: [f32; 3]) -> Material {
    let (channel, node) = constant(&albedo);
    material("Matte", vec![("albedo", channel, node)])
}

/// An ideal diffuse surface with its albedo in a primvar; black without.
pub fn matte_from_primvar(name: &str) -> Material {
    let node = Node::Primvar {
        name: name.into(),
        fallback: [0.0; 4],
    };
    material("Matte", vec![("albedo", Channel::Rgb, node)])
}

/// A UsdPreviewSurface; each input has one value, or three for a color.
pub fn preview(inputs: &[(&str, &[f32])]) -> Material {
    let nodes = inputs.iter().map(|&(name, values)| {
        let (channel, node) = constant(values);
        (name, channel, node)
    });
    material("UsdPreviewSurface", nodes.collect())
}

/// A `Glass`; each input has one value, or three for a color.
pub fn glass(inputs: &[(&str, &[f32])]) -> Material {
    Material {
        shader: "Glass".into(),
        ..preview(inputs)
    }
}

/// Emits `radiance` from both sides and reflects nothing: a metal of no reflectance.
pub fn black_emitter(radiance: f32) -> Material {
    preview(&[
        ("diffuseColor", &[0.0, 0.0, 0.0]),
        ("metallic", &[1.0]),
        ("emissiveColor", &[radiance; 3]),
    ])
}

/// The material with an input `opacity`; a UsdPreviewSurface is then partly present.
pub fn with_opacity(mut material: Material, opacity: f32) -> Material {
    for (name, value) in [("opacity", opacity), ("opacityMode", 1.0)] {
        if name == "opacityMode" && material.shader == "Matte" {
            continue;
        }
        let (channel, node) = constant(&[value]);
        let input = Input {
            node: material.nodes.len() as u32,
            channel,
        };
        material.inputs.insert(name.into(), input);
        material.nodes.push(node);
    }
    material
}
