//! Subdivision surfaces.
use crate::payload::{PolyMesh, Subdivision};
use crate::report::Report;
use crate::surface::Surface;

/// How finely a mesh is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SizeOnScreen {
    pub(crate) pixels_per_unit: f64,
    pub(crate) pixels_per_edge: f64,
    pub(crate) max_level: u32,
}

pub(crate) fn subdivide<'a>(
    _mesh: &PolyMesh<'a>,
    _subdivision: &Subdivision<'a>,
    cage: Surface<'a>,
    _size: SizeOnScreen,
    _report: &mut Report,
) -> Surface<'a> {
    cage
}
