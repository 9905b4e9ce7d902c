use std::borrow::Cow;

use crate::payload::Primvar;
use crate::tokens::PrimvarInterpolation;

/// What the values of a [`Channel`] belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Domain {
    Constant,
    Face,
    Point,
    Corner,
}

/// Validated data on a surface: element to value, perhaps through indices.
#[derive(Clone, Debug)]
pub(crate) struct Channel<'a> {
    pub(crate) name: &'a str,
    /// Floats per value.
    pub(crate) width: usize,
    pub(crate) domain: Domain,
    pub(crate) values: Cow<'a, [f32]>,
    pub(crate) indices: Option<Cow<'a, [u32]>>,
}

/// How many elements a mesh has of each kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counts {
    pub(crate) points: usize,
    pub(crate) faces: usize,
    pub(crate) corners: usize,
}

impl<'a> Channel<'a> {
    /// Checks a primvar against the mesh; the error says what does not fit.
    pub(crate) fn from_primvar(primvar: &Primvar<'a>, counts: Counts) -> Result<Self, String> {
        let width = usize::from(primvar.width);
        if !(1..=4).contains(&width) {
            return Err(format!("has {width} floats a value, expected 1 to 4"));
        }
        if !primvar.values.len().is_multiple_of(width) {
            let n = primvar.values.len();
            return Err(format!("has {n} floats, no multiple of {width}"));
        }
        let (domain, n_elements) = match primvar.interpolation {
            PrimvarInterpolation::Constant => (Domain::Constant, 1),
            PrimvarInterpolation::Uniform => (Domain::Face, counts.faces),
            PrimvarInterpolation::Varying | PrimvarInterpolation::Vertex => {
                (Domain::Point, counts.points)
            }
            PrimvarInterpolation::FaceVarying => (Domain::Corner, counts.corners),
        };
        let n_values = primvar.values.len() / width;
        let n_found = primvar.indices.map_or(n_values, <[i32]>::len);
        if n_found != n_elements {
            let what = if primvar.indices.is_some() {
                "indices"
            } else {
                "values"
            };
            return Err(format!("has {n_found} {what}, expected {n_elements}"));
        }
        let indices: Option<&[u32]> = primvar.indices.map(bytemuck::cast_slice);
        // Negative indices are huge as u32.
        if let Some(at) = indices.and_then(|i| i.iter().position(|&i| i as usize >= n_values)) {
            let index = indices.map_or(0, |i| i[at] as i32);
            return Err(format!("indices[{at}] is {index}, outside 0..{n_values}"));
        }
        Ok(Self {
            name: primvar.name,
            width,
            domain,
            values: Cow::Borrowed(primvar.values),
            indices: indices.map(Cow::Borrowed),
        })
    }

    /// The value of an element of the channel's domain.
    #[inline]
    pub(crate) fn value(&self, element: u32) -> &[f32] {
        let i = self
            .indices
            .as_ref()
            .map_or(element, |i| i[element as usize]) as usize;
        &self.values[i * self.width..(i + 1) * self.width]
    }

    /// Whether two elements have the same value, bit for bit.
    #[inline]
    pub(crate) fn same(&self, a: u32, b: u32) -> bool {
        if let Some(indices) = &self.indices
            && indices[a as usize] == indices[b as usize]
        {
            return true;
        }
        let (a, b) = (self.value(a), self.value(b));
        a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(interpolation: &str, n_floats: usize, indices: Option<&[i32]>) -> Result<(), String> {
        let primvar = Primvar {
            name: "st",
            width: 2,
            interpolation: interpolation.parse().unwrap(),
            values: &vec![0.0; n_floats],
            indices,
        };
        let counts = Counts {
            points: 4,
            faces: 2,
            corners: 6,
        };
        Channel::from_primvar(&primvar, counts).map(|_| ())
    }

    #[test]
    fn each_interpolation_has_its_length() {
        for (interpolation, n) in [
            ("constant", 1),
            ("uniform", 2),
            ("varying", 4),
            ("vertex", 4),
            ("faceVarying", 6),
        ] {
            assert_eq!(check(interpolation, 2 * n, None), Ok(()));
            assert!(check(interpolation, 2 * n + 2, None).is_err());
            assert!(check(interpolation, 2 * n + 1, None).is_err());
        }
    }

    #[test]
    fn indices_stay_inside_the_values() {
        assert_eq!(check("uniform", 6, Some(&[2, 0])), Ok(()));
        assert!(check("uniform", 6, Some(&[3, 0])).is_err());
        assert!(check("uniform", 6, Some(&[-1, 0])).is_err());
        assert!(check("uniform", 6, Some(&[0])).is_err());
    }
}
