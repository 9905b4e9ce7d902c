use std::collections::BTreeSet;

use kilauea_scene::Material;

use crate::declaration::Allowed;
use crate::graph::GraphCompiler;
use crate::{Input, InputValue, Lookups, ShaderError};

/// The inputs of one material, while its shader is compiled.
pub struct ShaderInputs<'m> {
    material: &'m Material,
    graph: GraphCompiler<'m>,
    read: BTreeSet<String>,
    out_of_range: Vec<String>,
}

/// What is known of a material's inputs once its shader is compiled.
#[derive(Clone, Debug, Default)]
pub struct InputSummary {
    /// The primvars that the inputs read, in slot order.
    pub primvars: Vec<String>,
    /// The textures that the inputs look up.
    pub lookups: Lookups,
    /// Authored inputs that the shader does not have.
    pub ignored: Vec<String>,
    /// For each constant outside its declared range, the input, its value and the range; and each
    /// pattern where a constant is needed.
    pub out_of_range: Vec<String>,
}

impl<'m> ShaderInputs<'m> {
    /// Starts reading the inputs of `material`.
    pub fn new(material: &'m Material) -> Self {
        Self {
            material,
            graph: GraphCompiler::new(material),
            read: BTreeSet::new(),
            out_of_range: Vec::new(),
        }
    }

    /// The input of that name, or its default where nothing is authored.
    pub fn get<T: InputValue>(&mut self, name: &str, default: T) -> Result<Input<T>, ShaderError> {
        self.read.insert(name.to_owned());
        match self.material.inputs.get(name) {
            None => Ok(Input::from_constant(default)),
            Some(input) => Ok(Input::from_pattern(
                self.graph.compile(input.node)?,
                input.channel,
            )),
        }
    }

    /// Holds a value against its declaration. A token that does not exist is an error; a number
    /// outside its range is noted, and shaded as what is nearest to it.
    pub fn check<T: InputValue>(
        &mut self,
        name: &str,
        input: &Input<T>,
        allowed: &Allowed,
    ) -> Result<(), ShaderError> {
        let constant = input.constant().map(InputValue::to_channels);
        match (allowed, constant) {
            (Allowed::Tokens(tokens), constant) => {
                let idx = constant.map(|[idx, ..]| idx);
                let exists = |idx| (0..tokens.len()).any(|token| token as f32 == idx);
                if idx.is_some_and(exists) {
                    return Ok(());
                }
                Err(ShaderError::Value {
                    material: self.material.path.clone(),
                    input: name.to_owned(),
                    value: idx.map_or("a pattern".to_owned(), |idx| idx.to_string()),
                    expected: allowed.to_string(),
                })
            }
            (Allowed::Range { min, max }, Some(value)) => {
                let value = &value[..T::WIDTH];
                if !value.iter().all(|v| (*min..=*max).contains(v)) {
                    self.out_of_range
                        .push(format!("inputs:{name} is {value:?}, outside {allowed}"));
                }
                Ok(())
            }
            (Allowed::Range { .. }, None) => Ok(()),
        }
    }

    /// The value of an input that must be the same everywhere. Where a pattern is authored, that is
    /// noted and the default is taken.
    pub fn uniform<T: InputValue>(&mut self, name: &str, input: &Input<T>, default: T) -> T {
        input.constant().unwrap_or_else(|| {
            let taken = &default.to_channels()[..T::WIDTH];
            self.out_of_range.push(format!(
                "inputs:{name} must be the same everywhere; {taken:?} is taken"
            ));
            default
        })
    }

    /// Ends reading.
    pub fn finish(self) -> InputSummary {
        let authored = self.material.inputs.keys();
        InputSummary {
            primvars: self.graph.primvars,
            lookups: Lookups::new(self.graph.textures.into_values()),
            ignored: authored
                .filter(|&name| !self.read.contains(name))
                .cloned()
                .collect(),
            out_of_range: self.out_of_range,
        }
    }
}
