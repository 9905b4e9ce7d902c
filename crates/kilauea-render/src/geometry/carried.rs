//! What an answer brings of a primitive that lies elsewhere.

use kilauea_scene::{Attribute, CurvesChunk, Interpolation};
use kilauea_shading::{Element, PrimvarLayout};

use super::Geometry;
use super::curve::Segment;
use super::interaction::View;
use super::locate::{Chunk, PrimitiveRef};
use super::placed::EngineTransform;
use super::shape_point::ShapePoint;
use super::sphere::Ball;
use super::triangle::Triangle;

/// A primitive that was hit elsewhere: its shape at the moment of the ray, and what its chunk's
/// primvars are there. From it an interaction is made as from the chunk itself, by the same code.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Carried {
    pub(crate) shape: Shape,
    /// The chunk's attributes, without their names, with the values of this primitive alone.
    pub(crate) attributes: Vec<Attribute>,
}

/// A primitive of any kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    Triangle(Triangle),
    Ball(Ball),
    Segment(Segment),
}

impl Shape {
    /// The point on it; the element is that of a chunk which has nothing else.
    pub(super) fn point(&self, transform: &EngineTransform, view: &View) -> ShapePoint {
        match self {
            Self::Triangle(triangle) => triangle.point(transform, view),
            Self::Ball(ball) => ball.point(transform, view),
            Self::Segment(segment) => segment.point(transform, view),
        }
    }
}

impl Geometry {
    /// Takes along what others need of a primitive that is here.
    pub(crate) fn carry(&self, at: PrimitiveRef, time: f32) -> Carried {
        let chunk = self.chunk(at);
        let shape = match chunk {
            Chunk::Mesh(mesh) => Shape::Triangle(Triangle::of(mesh, at.primitive, time)),
            Chunk::Points(points) => Shape::Ball(Ball::of(points, at.primitive, time)),
            Chunk::Curves(curves) => Shape::Segment(Segment::of(curves, at.primitive, time)),
        };
        let attributes = chunk.attributes().iter();
        Carried {
            shape,
            attributes: attributes
                .map(|a| values_of(a, chunk, at.primitive))
                .collect(),
        }
    }
}

/// An attribute with the values of one primitive; with none where it is too short for its chunk,
/// which is as if it were not there.
fn values_of(attribute: &Attribute, chunk: Chunk<'_>, primitive: u32) -> Attribute {
    let width = attribute.width as usize;
    let mut data = Vec::new();
    let is_complete = PrimvarLayout::is_complete(attribute, chunk.counts());
    let mut take = |indices: &[u32]| {
        for &i in indices.iter().filter(|_| is_complete) {
            data.extend_from_slice(&attribute.data[i as usize * width..][..width]);
        }
    };
    match (attribute.interpolation, chunk) {
        (Interpolation::Constant, _) => take(&[0]),
        (Interpolation::Uniform, _) | (_, Chunk::Points(_)) => take(&[primitive]),
        (Interpolation::Vertex, Chunk::Mesh(mesh)) => take(&mesh.triangles[primitive as usize]),
        (Interpolation::Vertex, Chunk::Curves(curves)) => {
            let first = curves.segments[primitive as usize];
            take(&[0, 1, 2, 3].map(|i| first + i)[..curves.basis.n_points()]);
        }
    }
    Attribute {
        name: String::new(),
        width: attribute.width,
        interpolation: attribute.interpolation,
        data,
    }
}

/// The element of a segment that is not alone in its chunk.
pub(super) fn segment_of(chunk: &CurvesChunk, number: u32, alone: Element) -> Element {
    match alone {
        Element::Segment {
            weights, slopes, ..
        } => Element::Segment {
            segment: number,
            first: chunk.segments[number as usize],
            weights,
            slopes,
        },
        other => other,
    }
}
