use std::fmt;
use std::ops::RangeInclusive;

use crate::graph::Channels;

/// What a shader says of itself: everything that validation, documentation and other programs
/// know of it comes from here.
#[derive(Clone, Debug, PartialEq)]
pub struct Declaration {
    /// What it is like, line by line.
    pub doc: &'static [&'static str],
    /// Its inputs.
    pub parameters: Vec<Parameter>,
}

/// A declared input of a shader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name, as authored.
    pub name: &'static str,
    /// float, int, float3 or color.
    pub type_name: &'static str,
    /// How many channels that are.
    pub width: usize,
    /// Value where nothing is authored, as channels.
    pub default: Channels,
    /// Which values make sense; none where all do.
    pub allowed: Option<Allowed>,
    /// What it does, line by line.
    pub doc: &'static [&'static str],
}

/// The values that make sense for an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allowed {
    /// Each channel from `min` to `max`.
    Range {
        /// Included.
        min: f32,
        /// Included.
        max: f32,
    },
    /// One of these words, the same everywhere; the value is its index.
    Tokens(&'static [&'static str]),
}

impl From<RangeInclusive<f32>> for Allowed {
    fn from(range: RangeInclusive<f32>) -> Self {
        let (min, max) = range.into_inner();
        Self::Range { min, max }
    }
}

impl<const N: usize> From<&'static [&'static str; N]> for Allowed {
    fn from(tokens: &'static [&'static str; N]) -> Self {
        Self::Tokens(tokens)
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range { min, max } => write!(f, "{min} to {max}"),
            Self::Tokens(tokens) => {
                for (idx, token) in tokens.iter().enumerate() {
                    let separator = if idx == 0 { "" } else { ", " };
                    write!(f, "{separator}{idx} ({token})")?;
                }
                Ok(())
            }
        }
    }
}

/// Declares a shader's inputs in one place: a struct with an [`crate::Input`] for each, a `read`
/// that takes them from [`crate::ShaderInputs`], and a `declaration` for everybody else.
///
/// In brackets stand the name as authored, the default and, where not every value makes sense,
/// the allowed range or tokens.
///
/// ```
/// use kilauea_shading::prelude::*;
///
/// parameters! {
///     /// A surface that reflects.
///     pub struct Inputs {
///         /// Fraction of light reflected.
///         albedo: Spectrum = ("albedo", Spectrum::splat(0.18), 0.0..=1.0),
///         /// What the rest does.
///         rest: f32 = ("rest", 0.0, &["absorbed", "transmitted"]),
///     }
/// }
/// assert_eq!(Inputs::declaration().parameters[0].type_name, "color");
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[doc = $struct_doc:literal])+
        $visibility:vis struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $field:ident: $type:ty = ($authored:literal, $default:expr $(, $allowed:expr)?),
            )*
        }
    ) => {
        $(#[doc = $struct_doc])+
        #[derive(Clone, Debug)]
        $visibility struct $name {
            $(
                $(#[doc = $doc])+
                pub $field: $crate::Input<$type>,
            )*
        }

        impl $name {
            /// Reads every input and holds it against its declaration; those not authored have
            /// their defaults.
            $visibility fn read(
                inputs: &mut $crate::ShaderInputs<'_>,
            ) -> Result<Self, $crate::ShaderError> {
                let read = Self {
                    $($field: inputs.get::<$type>($authored, $default)?,)*
                };
                $($(inputs.check($authored, &read.$field, &$crate::Allowed::from($allowed))?;)?)*
                Ok(read)
            }

            /// What is declared.
            $visibility fn declaration() -> $crate::Declaration {
                let parameters = vec![
                    $($crate::Parameter {
                        name: $authored,
                        type_name: <$type as $crate::InputValue>::TYPE_NAME,
                        width: <$type as $crate::InputValue>::WIDTH,
                        default: $crate::InputValue::to_channels($default),
                        allowed: [$($crate::Allowed::from($allowed))?].first().copied(),
                        doc: &[$($doc),+],
                    },)*
                ];
                $crate::Declaration {
                    doc: &[$($struct_doc),+],
                    parameters,
                }
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use kilauea_math::Spectrum;
    use kilauea_scene::{Channel, Input as MaterialInput, Material, Node};

    use crate::{InputSummary, ShaderError, ShaderInputs};

    parameters! {
        /// Of a test.
        struct Inputs {
            /// Within a range.
            albedo: Spectrum = ("albedo", Spectrum::ONE, 0.0..=1.0),
            /// A word.
            mode: f32 = ("mode", 1.0, &["thin", "thick"]),
            /// Anything.
            gain: f32 = ("gain", 2.0),
        }
    }

    fn read(name: &str, node: Node) -> Result<(Inputs, InputSummary), ShaderError> {
        let input = MaterialInput {
            node: 0,
            channel: Channel::Rgb,
        };
        let material = Material {
            path: "/Looks/Test".into(),
            shader: "Test".into(),
            inputs: [(name.to_owned(), input)].into(),
            nodes: vec![node],
        };
        let mut inputs = ShaderInputs::new(&material);
        let read = Inputs::read(&mut inputs)?;
        Ok((read, inputs.finish()))
    }

    fn constant(value: [f32; 4]) -> Node {
        Node::Constant { value }
    }

    fn pattern() -> Node {
        Node::Primvar {
            name: "p".into(),
            fallback: [9.0; 4],
        }
    }

    #[test]
    fn constants_out_of_range_are_noted() {
        let noted = |name, node| read(name, node).unwrap().1.out_of_range;
        assert_eq!(
            noted("albedo", constant([0.5, 1.5, -0.1, 1.0])),
            ["inputs:albedo is [0.5, 1.5, -0.1], outside 0 to 1"]
        );
        assert_eq!(noted("albedo", constant([f32::NAN; 4])).len(), 1);
        for fine in [
            ("albedo", constant([0.0, 1.0, 0.5, 7.0])),
            ("albedo", pattern()),
            ("gain", constant([-1e9; 4])),
        ] {
            assert!(noted(fine.0, fine.1).is_empty());
        }
    }

    #[test]
    fn tokens_are_constants_that_exist() {
        assert!(read("mode", constant([0.0; 4])).is_ok());
        for node in [constant([2.0; 4]), constant([0.5; 4]), pattern()] {
            let error = read("mode", node).unwrap_err().to_string();
            for part in ["/Looks/Test: inputs:mode is", "0 (thin), 1 (thick)"] {
                assert!(error.contains(part), "{error}");
            }
        }
    }

    #[test]
    fn a_pattern_where_one_value_is_needed_is_noted() {
        for (node, expected, n_noted) in [(constant([7.0; 4]), 7.0, 0), (pattern(), 2.0, 1)] {
            let input = MaterialInput {
                node: 0,
                channel: Channel::Rgb,
            };
            let material = Material {
                path: "/Looks/Test".into(),
                shader: "Test".into(),
                inputs: [("gain".to_owned(), input)].into(),
                nodes: vec![node],
            };
            let mut inputs = ShaderInputs::new(&material);
            let read = Inputs::read(&mut inputs).unwrap();
            assert_eq!(inputs.uniform("gain", &read.gain, 2.0), expected);
            assert_eq!(inputs.finish().out_of_range.len(), n_noted);
        }
    }

    #[test]
    fn what_is_authored_stands_over_the_default() {
        let (read, _) = read("gain", constant([7.0; 4])).unwrap();
        assert_eq!(
            (read.gain.constant(), read.mode.constant()),
            (Some(7.0), Some(1.0))
        );
        assert_eq!(read.albedo.constant(), Some(Spectrum::ONE));
    }

    #[test]
    fn the_declaration_has_what_stands_in_the_source() {
        let declared = Inputs::declaration();
        assert_eq!(declared.doc, [" Of a test."]);
        let [albedo, mode, gain] = declared.parameters[..] else {
            panic!("{declared:?}");
        };
        assert_eq!((albedo.type_name, albedo.width), ("color", 3));
        assert_eq!((mode.name, mode.default[0]), ("mode", 1.0));
        assert_eq!(gain.doc, [" Anything."]);
        assert_eq!(gain.allowed, None);
        assert!(albedo.allowed.is_some() && mode.allowed.is_some());
    }
}
