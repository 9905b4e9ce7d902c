//! Carried primitives as bytes: nothing but the numbers, and one byte of what they are.

use kilauea_math::Vec3;
use kilauea_scene::{Attribute, CurveBasis, CurveProfile, Interpolation};
use kilauea_spot::{Wire, WireError};

use crate::geometry::{Ball, Carried, Segment, Shape, Triangle};

const FACETED: u8 = 0;
const SMOOTH: u8 = 1;
const BALL: u8 = 2;
const SEGMENT: u8 = 3;

const SEGMENT_IS_BEZIER: u8 = 1;
const SEGMENT_IS_RIBBON: u8 = 2;
const SEGMENT_IS_ORIENTED: u8 = 4;

impl Wire for Carried {
    fn encode(&self, bytes: &mut Vec<u8>) {
        encode_shape(&self.shape, bytes);
        (self.attributes.len() as u16).encode(bytes);
        let attributes = self.attributes.iter().take(u16::MAX.into());
        attributes.for_each(|attribute| encode_attribute(attribute, bytes));
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        let shape = decode_shape(bytes)?;
        let n = u16::decode(bytes)?;
        let attributes = (0..n).map(|_| decode_attribute(bytes));
        Ok(Self {
            shape,
            attributes: attributes.collect::<Result<_, _>>()?,
        })
    }
}

/// Moves `bytes` behind a carried primitive, which is checked as if it were read.
pub(super) fn skip_carried(bytes: &mut &[u8]) -> Result<(), WireError> {
    let n_words = match u8::decode(bytes)? {
        FACETED => 9,
        SMOOTH => 18,
        BALL => 4,
        SEGMENT => {
            let flags = decode_segment_flags(bytes)?;
            let is_oriented = flags & SEGMENT_IS_ORIENTED != 0;
            basis_of(flags).n_points() * if is_oriented { 7 } else { 4 }
        }
        other => return Err(WireError::Variant(other)),
    };
    skip_words(n_words, bytes)?;
    for _ in 0..u16::decode(bytes)? {
        let (width, _, n_values) = decode_head(bytes)?;
        skip_words(n_values * usize::from(width), bytes)?;
    }
    Ok(())
}

fn skip_words(n: usize, bytes: &mut &[u8]) -> Result<(), WireError> {
    let (_, rest) = bytes.split_at_checked(4 * n).ok_or(WireError::Short)?;
    *bytes = rest;
    Ok(())
}

fn encode_shape(shape: &Shape, bytes: &mut Vec<u8>) {
    match shape {
        Shape::Triangle(Triangle { corners, normals }) => {
            let kind = if normals.is_some() { SMOOTH } else { FACETED };
            kind.encode(bytes);
            encode_points(corners, bytes);
            encode_points(normals.as_ref().map_or(&[], |n| &n[..]), bytes);
        }
        Shape::Ball(Ball { center, radius }) => {
            BALL.encode(bytes);
            encode_points(&[*center], bytes);
            radius.encode(bytes);
        }
        Shape::Segment(segment) => {
            let flag = |is_set, flag| if is_set { flag } else { 0 };
            SEGMENT.encode(bytes);
            let flags = flag(segment.basis == CurveBasis::Bezier, SEGMENT_IS_BEZIER)
                | flag(segment.profile == CurveProfile::Ribbon, SEGMENT_IS_RIBBON)
                | flag(segment.normals.is_some(), SEGMENT_IS_ORIENTED);
            flags.encode(bytes);
            let n = segment.basis.n_points();
            encode_points(&segment.controls[..n], bytes);
            segment.radii[..n].iter().for_each(|r| r.encode(bytes));
            encode_points(segment.normals.as_ref().map_or(&[], |all| &all[..n]), bytes);
        }
    }
}

fn decode_shape(bytes: &mut &[u8]) -> Result<Shape, WireError> {
    match u8::decode(bytes)? {
        kind @ (FACETED | SMOOTH) => Ok(Shape::Triangle(Triangle {
            corners: decode_points(3, bytes)?,
            normals: (kind == SMOOTH)
                .then(|| decode_points(3, bytes))
                .transpose()?,
        })),
        BALL => {
            let [center] = decode_points(1, bytes)?;
            let radius = f32::decode(bytes)?;
            Ok(Shape::Ball(Ball { center, radius }))
        }
        SEGMENT => {
            let flags = decode_segment_flags(bytes)?;
            let basis = basis_of(flags);
            let n = basis.n_points();
            let controls = decode_points(n, bytes)?;
            let mut radii = [0.0; 4];
            for radius in &mut radii[..n] {
                *radius = f32::decode(bytes)?;
            }
            Ok(Shape::Segment(Segment {
                basis,
                profile: match flags & SEGMENT_IS_RIBBON {
                    0 => CurveProfile::Round,
                    _ => CurveProfile::Ribbon,
                },
                controls,
                radii,
                normals: (flags & SEGMENT_IS_ORIENTED != 0)
                    .then(|| decode_points(n, bytes))
                    .transpose()?,
            }))
        }
        other => Err(WireError::Variant(other)),
    }
}

fn decode_segment_flags(bytes: &mut &[u8]) -> Result<u8, WireError> {
    let flags = u8::decode(bytes)?;
    if flags > (SEGMENT_IS_BEZIER | SEGMENT_IS_RIBBON | SEGMENT_IS_ORIENTED) {
        return Err(WireError::Variant(flags));
    }
    Ok(flags)
}

fn basis_of(segment_flags: u8) -> CurveBasis {
    match segment_flags & SEGMENT_IS_BEZIER {
        0 => CurveBasis::Linear,
        _ => CurveBasis::Bezier,
    }
}

fn encode_points(points: &[Vec3], bytes: &mut Vec<u8>) {
    for p in points {
        p.to_array().encode(bytes);
    }
}

/// So many points, and zeros.
fn decode_points<const N: usize>(n: usize, bytes: &mut &[u8]) -> Result<[Vec3; N], WireError> {
    let mut points = [Vec3::ZERO; N];
    for p in points.iter_mut().take(n) {
        *p = Vec3::from_array(Wire::decode(bytes)?);
    }
    Ok(points)
}

/// A primitive has no more points than that.
const MAX_VALUES: usize = 4;

/// Two bits each of width less one and interpolation, then the number of values.
fn encode_attribute(attribute: &Attribute, bytes: &mut Vec<u8>) {
    let width = attribute.width.clamp(1, 4);
    let interpolation = match attribute.interpolation {
        Interpolation::Constant => 0,
        Interpolation::Uniform => 1,
        Interpolation::Vertex => 2,
    };
    let n_values = (attribute.data.len() / usize::from(width)).min(MAX_VALUES);
    ((width - 1) | interpolation << 2 | (n_values as u8) << 4).encode(bytes);
    let data = attribute.data.iter().take(n_values * usize::from(width));
    data.for_each(|value| value.encode(bytes));
}

fn decode_attribute(bytes: &mut &[u8]) -> Result<Attribute, WireError> {
    let (width, interpolation, n_values) = decode_head(bytes)?;
    let data = (0..n_values * usize::from(width)).map(|_| f32::decode(bytes));
    Ok(Attribute {
        name: String::new(),
        width,
        interpolation,
        data: data.collect::<Result<_, _>>()?,
    })
}

/// An attribute's width, interpolation and number of values.
fn decode_head(bytes: &mut &[u8]) -> Result<(u8, Interpolation, usize), WireError> {
    let head = u8::decode(bytes)?;
    let width = (head & 3) + 1;
    let n_values = usize::from(head >> 4);
    let interpolation = match head >> 2 & 3 {
        _ if n_values > MAX_VALUES => return Err(WireError::Variant(head)),
        0 => Interpolation::Constant,
        1 => Interpolation::Uniform,
        2 => Interpolation::Vertex,
        _ => return Err(WireError::Variant(head)),
    };
    Ok((width, interpolation, n_values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::hash::combine;

    fn attribute(interpolation: Interpolation, width: u8, n: usize) -> Attribute {
        Attribute {
            name: String::new(),
            width,
            interpolation,
            data: (0..n * usize::from(width))
                .map(|i| 0.5 * i as f32)
                .collect(),
        }
    }

    fn all() -> Vec<Carried> {
        let points = [
            Vec3::ZERO,
            Vec3::X,
            Vec3::new(-0.0, 1e-40, 3.0),
            Vec3::NEG_Z,
        ];
        let corners = [points[0], points[1], points[2]];
        let segment = |basis, profile, normals: Option<[Vec3; 4]>| {
            let n = CurveBasis::n_points(basis);
            let cut =
                |all: [Vec3; 4]| std::array::from_fn(|i| if i < n { all[i] } else { Vec3::ZERO });
            Shape::Segment(Segment {
                basis,
                profile,
                controls: cut(points),
                radii: std::array::from_fn(|i| if i < n { 0.25 } else { 0.0 }),
                normals: normals.map(cut),
            })
        };
        let shapes = [
            Shape::Triangle(Triangle {
                corners,
                normals: None,
            }),
            Shape::Triangle(Triangle {
                corners,
                normals: Some(corners),
            }),
            Shape::Ball(Ball {
                center: Vec3::Y,
                radius: 0.5,
            }),
            segment(CurveBasis::Linear, CurveProfile::Round, None),
            segment(CurveBasis::Bezier, CurveProfile::Ribbon, Some(points)),
        ];
        let attributes = [
            attribute(Interpolation::Constant, 3, 1),
            attribute(Interpolation::Vertex, 2, 3),
            attribute(Interpolation::Uniform, 4, 0),
        ];
        let with = |(i, shape)| Carried {
            shape,
            attributes: attributes[..i % 4].to_vec(),
        };
        shapes.into_iter().enumerate().map(with).collect()
    }

    #[test]
    fn carried_primitives_survive_and_short_ones_are_refused() {
        for carried in all() {
            let mut bytes = Vec::new();
            carried.encode(&mut bytes);
            let mut rest = bytes.as_slice();
            assert_eq!(Carried::decode(&mut rest), Ok(carried));
            assert!(rest.is_empty());
            let mut rest = bytes.as_slice();
            assert_eq!(skip_carried(&mut rest), Ok(()));
            assert!(rest.is_empty());
            for end in 0..bytes.len() {
                assert_eq!(Carried::decode(&mut &bytes[..end]), Err(WireError::Short));
                assert_eq!(skip_carried(&mut &bytes[..end]), Err(WireError::Short));
            }
        }
    }

    /// Whatever is passed over can be read.
    #[test]
    fn skipping_is_reading() {
        let mut n_read = 0;
        for seed in 0..100_000 {
            let random = |i| combine(seed, i) as u8;
            // Few attributes, or none could be read to its end.
            let kind = random(0) % 5;
            let bytes: Vec<u8> = std::iter::once(kind)
                .chain((1..200).map(|i| random(i) & if i % 3 == 0 { 7 } else { 0x27 }))
                .collect();
            let (mut read, mut skipped) = (bytes.as_slice(), bytes.as_slice());
            let carried = Carried::decode(&mut read).map(drop);
            assert_eq!(skip_carried(&mut skipped), carried);
            if carried.is_ok() {
                assert_eq!(skipped, read);
                n_read += 1;
            }
        }
        assert!(n_read > 100, "{n_read}");
    }

    #[test]
    fn sizes_on_the_wire() {
        let sizes = all().into_iter().map(|carried| {
            let mut bytes = Vec::new();
            encode_shape(&carried.shape, &mut bytes);
            bytes.len()
        });
        // A byte of kind, then 12 bytes a point or normal; 4 bytes a radius.
        assert_eq!(sizes.collect::<Vec<_>>(), [37, 73, 17, 34, 114]);
    }

    #[test]
    fn bytes_that_are_nothing_are_refused() {
        assert_eq!(Carried::decode(&mut &[4][..]), Err(WireError::Variant(4)));
        assert_eq!(
            Carried::decode(&mut &[3, 8][..]),
            Err(WireError::Variant(8))
        );
        for head in [0b1100, 0x50] {
            let bytes = [head; 80];
            let decoded = decode_attribute(&mut &bytes[..]);
            assert_eq!(decoded, Err(WireError::Variant(head)));
        }
    }
}
