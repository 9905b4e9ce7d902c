//! What is generated from the declarations is up to date and says what they say.

#![forbid(unsafe_code)]

use std::path::Path;

use kilauea_math::Spectrum;
use kilauea_shading::parameters;
use shaders::Shader;
use shaders::describe::{reference_page, shader_defs};

parameters! {
    /// Cloth that
    /// shimmers.
    struct Velvet {
        /// Where it lies.
        side: f32 = ("side", 1.0, &["front", "back"]),
        /// Its color.
        sheen: Spectrum = ("sheen", Spectrum::new(0.5, 0.0, 1.0)),
    }
}

#[test]
fn generated_files_are_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let shaders = Shader::declarations();
    for (file, expected) in [
        ("shaders/usd/shaderDefs.usda", shader_defs(&shaders)),
        ("docs/shaders.md", reference_page(&shaders)),
    ] {
        let found = std::fs::read_to_string(root.join(file)).unwrap_or_default();
        assert!(found == expected, "{file} is stale: run `make describe`");
    }
}

#[test]
fn declarations_are_written_out() {
    let shaders = [("Velvet", Velvet::declaration())];
    let defs = shader_defs(&shaders);
    for part in [
        "def Shader \"Velvet\" (\n    sdrMetadata = {\n        string help = \"Cloth that shimmers.\"",
        "info:id = \"kilauea:Velvet\"",
        "token inputs:side = \"back\" (",
        "allowedTokens = [\"front\", \"back\"]",
        "color3f inputs:sheen = (0.5, 0, 1) (\n        sdrMetadata = {",
        "string help = \"Its color.\"",
    ] {
        assert!(defs.contains(part), "{part} is not in {defs}");
    }
    let page = reference_page(&shaders);
    for part in [
        "## kilauea:Velvet\n\nCloth that shimmers.\n",
        "| `side` | token | back | front, back | Where it lies. |",
        "| `sheen` | color3f | (0.5, 0, 1) |  | Its color. |",
    ] {
        assert!(page.contains(part), "{part} is not in {page}");
    }
}

#[test]
fn what_usd_defines_is_not_defined_again() {
    let defs = shader_defs(&Shader::declarations());
    assert!(defs.contains("kilauea:Matte") && !defs.contains("UsdPreviewSurface"));
    assert!(reference_page(&Shader::declarations()).contains("## UsdPreviewSurface"));
}
