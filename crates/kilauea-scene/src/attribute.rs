use serde::{Deserialize, Serialize};

/// How an [`Attribute`] varies over a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Interpolation {
    /// One value.
    Constant,
    /// One value per triangle, or per segment of a curve.
    Uniform,
    /// One value per vertex, linear in between; per control point of a curve, in between by the
    /// curve's basis; per point.
    Vertex,
}

/// A primvar: `width` floats per value, values as [`Interpolation`] counts them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attribute {
    /// Name without the `primvars:` prefix.
    pub name: String,
    /// Floats per value, 1 to 4.
    pub width: u8,
    /// How values map to the chunk.
    pub interpolation: Interpolation,
    /// The values, `width` floats each.
    pub data: Vec<f32>,
}

impl Attribute {
    /// The attribute without its values, unless it has one for all.
    #[must_use]
    pub(crate) fn husk(&self) -> Self {
        Self {
            name: self.name.clone(),
            data: match self.interpolation {
                Interpolation::Constant => self.data.clone(),
                Interpolation::Uniform | Interpolation::Vertex => Vec::new(),
            },
            ..*self
        }
    }
}

/// Bytes held by the values.
pub(crate) fn n_bytes(attributes: &[Attribute]) -> usize {
    attributes.iter().map(|a| 4 * a.data.len()).sum()
}
