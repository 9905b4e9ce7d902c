use std::collections::BTreeSet;

use kilauea_scene::Material;

use crate::graph::{Channels, GraphCompiler};
use crate::{Input, InputValue, ShaderError};

/// A declared input of a shader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name, as authored.
    pub name: &'static str,
    /// float, float3 or color.
    pub type_name: &'static str,
    /// Value where nothing is authored, as channels.
    pub default: Channels,
    /// What it does, one line each.
    pub doc: &'static [&'static str],
}

/// The inputs of one material, while its shader is compiled.
pub struct ShaderInputs<'m> {
    material: &'m Material,
    graph: GraphCompiler<'m>,
    read: BTreeSet<String>,
}

/// What is known of a material's inputs once its shader is compiled.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InputSummary {
    /// The primvars that the inputs read, in slot order.
    pub primvars: Vec<String>,
    /// Authored inputs that the shader does not have.
    pub ignored: Vec<String>,
}

impl<'m> ShaderInputs<'m> {
    /// Starts reading the inputs of `material`.
    pub fn new(material: &'m Material) -> Self {
        Self {
            material,
            graph: GraphCompiler::new(material),
            read: BTreeSet::new(),
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

    /// An error about an input's value.
    pub fn invalid(&self, input: &str, value: &str, expected: &str) -> ShaderError {
        ShaderError::Value {
            material: self.material.path.clone(),
            input: input.to_owned(),
            value: value.to_owned(),
            expected: expected.to_owned(),
        }
    }

    /// Ends reading.
    pub fn finish(self) -> InputSummary {
        let authored = self.material.inputs.keys();
        InputSummary {
            primvars: self.graph.primvars,
            ignored: authored
                .filter(|&name| !self.read.contains(name))
                .cloned()
                .collect(),
        }
    }
}

/// Declares the inputs of a shader in one place: a struct with an [`Input`] for each, a `read`
/// that takes them from [`ShaderInputs`], and `parameters` for documentation.
///
/// ```
/// use kilauea_shading::prelude::*;
///
/// parameters! {
///     /// Inputs of a shader.
///     pub struct Inputs {
///         /// Fraction of light reflected.
///         albedo: Spectrum = ("albedo", Spectrum::splat(0.18)),
///     }
/// }
/// assert_eq!(Inputs::parameters()[0].type_name, "color");
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$struct_attribute:meta])*
        $visibility:vis struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $field:ident: $type:ty = ($authored:literal, $default:expr),
            )*
        }
    ) => {
        $(#[$struct_attribute])*
        #[derive(Clone, Debug)]
        $visibility struct $name {
            $(
                $(#[doc = $doc])+
                pub $field: $crate::Input<$type>,
            )*
        }

        impl $name {
            /// Reads every input; those not authored have their defaults.
            $visibility fn read(
                inputs: &mut $crate::ShaderInputs<'_>,
            ) -> Result<Self, $crate::ShaderError> {
                Ok(Self {
                    $($field: inputs.get::<$type>($authored, $default)?,)*
                })
            }

            /// The declarations.
            $visibility fn parameters() -> Vec<$crate::Parameter> {
                vec![
                    $($crate::Parameter {
                        name: $authored,
                        type_name: <$type as $crate::InputValue>::TYPE_NAME,
                        default: $crate::InputValue::to_channels($default),
                        doc: &[$($doc),+],
                    },)*
                ]
            }
        }
    };
}
