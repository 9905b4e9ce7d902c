use ::shaders::Shader;
use ::shaders::describe::{Allowed, info_id, usd_type};
use pyo3::prelude::*;
use serde_json::{Map, Value, json};

/// What the shaders declare, as JSON: by `info:id` the shader's name and its inputs, and for each
/// input its type on a stage and, for tokens, the words in the order of their values.
#[pyfunction]
pub(crate) fn shader_declarations() -> String {
    let mut by_id = Map::new();
    for (shader, declaration) in Shader::declarations() {
        let mut inputs = Map::new();
        for parameter in &declaration.parameters {
            let tokens = match parameter.allowed {
                Some(Allowed::Tokens(tokens)) => tokens,
                _ => &[],
            };
            let input = json!({ "type": usd_type(parameter), "tokens": tokens });
            inputs.insert(parameter.name.to_owned(), input);
        }
        let record = json!({ "shader": shader, "inputs": inputs });
        by_id.insert(info_id(shader), record);
    }
    Value::Object(by_id).to_string()
}
