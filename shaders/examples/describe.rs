//! Writes what is generated from the shaders' declarations; run it from the repository's root.

#![forbid(unsafe_code)]

use std::fs::write;

use shaders::Shader;
use shaders::describe::{reference_page, shader_defs};

fn main() -> std::io::Result<()> {
    let shaders = Shader::declarations();
    write("shaders/usd/shaderDefs.usda", shader_defs(&shaders))?;
    write("docs/shaders.md", reference_page(&shaders))
}
