//! Curves by the rules of UsdGeomBasisCurves, as linear or Bézier segments.

mod build;
mod stencil;

use std::ops::Range;

use kilauea_math::{DAffine3, DVec3};

use crate::channel::{Channel, Counts};
use crate::payload::{BasisCurves, Primvar};
use crate::report::Report;
use crate::surface::is_placeable;
use crate::tokens::PrimvarInterpolation;

pub(crate) use build::build_curves;
use stencil::CurveKind;

/// One curve of a prim.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Number among the prim's curves.
    idx: u32,
    points: Range<usize>,
    /// First of its varying values.
    first_varying: u32,
    n_segments: usize,
}

/// The curves of a prim that can be drawn, and what is known of their arrays.
#[derive(Clone, Debug)]
pub(crate) struct CheckedCurves {
    kind: CurveKind,
    curves: Vec<Curve>,
    counts: Counts,
}

/// Checks that counts and points fit together; the prim cannot be used otherwise. Curves with the
/// wrong number of points, or with points that are not finite, are left out.
pub(crate) fn check_curves(
    prim: &BasisCurves<'_>,
    prototype_from_curves: &DAffine3,
    report: &mut Report,
) -> Option<CheckedCurves> {
    let counts = prim.curve_vertex_counts;
    if let Some(at) = counts.iter().position(|&c| c < 0) {
        let what = format_args!("[{at}] is {}; prim skipped", counts[at]);
        report.warn(prim.path, "curveVertexCounts", what);
        return None;
    }
    let n_points: u64 = counts.iter().map(|&c| c as u64).sum();
    if n_points != prim.points.len() as u64 || n_points >= u64::from(u32::MAX / 4) {
        let what = format_args!(
            "add up to {n_points}, but there are {} points; prim skipped",
            prim.points.len()
        );
        report.warn(prim.path, "curveVertexCounts", what);
        return None;
    }
    let kind = CurveKind {
        curve_type: prim.curve_type,
        basis: prim.basis,
        wrap: prim.wrap,
    };
    let is_good = |points: &[[f32; 3]]| {
        points.iter().all(|p| {
            let p = DVec3::from_array(p.map(f64::from));
            is_placeable(p) && is_placeable(prototype_from_curves.transform_point3(p))
        })
    };
    let mut curves = Vec::with_capacity(counts.len());
    let (mut n_misfits, mut n_not_finite) = (0, 0);
    let (mut first_point, mut n_varying) = (0, 0);
    for (idx, &count) in counts.iter().enumerate() {
        let points = first_point..first_point + count as usize;
        first_point = points.end;
        let Some(n_segments) = kind.n_segments(points.len()) else {
            n_misfits += 1;
            continue;
        };
        let first_varying = n_varying as u32;
        n_varying += kind.n_varying(n_segments);
        let mut keys = std::iter::once(&prim.points).chain(&prim.later_points);
        if !keys.all(|key| key.get(points.clone()).is_none_or(is_good)) {
            n_not_finite += 1;
            continue;
        }
        curves.push(Curve {
            idx: idx as u32,
            points,
            first_varying,
            n_segments,
        });
    }
    if n_misfits > 0 {
        let what =
            format_args!("{n_misfits} curves skipped: too few points, or not a whole segment");
        report.warn(prim.path, "curveVertexCounts", what);
    }
    if n_not_finite > 0 {
        let what = format_args!("{n_not_finite} curves skipped: points are not finite");
        report.warn(prim.path, "points", what);
    }
    Some(CheckedCurves {
        kind,
        curves,
        counts: Counts {
            points: prim.points.len(),
            faces: counts.len(),
            // A channel's corners stand for the ends of segments.
            corners: n_varying,
        },
    })
}

impl CheckedCurves {
    /// Curves that are drawn, by the points that they have.
    pub(crate) fn point_ranges(&self) -> impl Iterator<Item = Range<usize>> {
        self.curves.iter().map(|curve| curve.points.clone())
    }

    /// A primvar of the prim; unlike on meshes, `varying` has a value per end of a segment.
    fn channel<'a>(&self, primvar: &Primvar<'a>) -> Result<Channel<'a>, String> {
        let interpolation = match primvar.interpolation {
            PrimvarInterpolation::Varying => PrimvarInterpolation::FaceVarying,
            other => other,
        };
        let primvar = Primvar {
            interpolation,
            ..primvar.clone()
        };
        Channel::from_primvar(&primvar, self.counts)
    }

    /// The channel of an attribute of fixed width that is no primvar.
    fn attribute<'a>(
        &self,
        path: &str,
        primvar: Option<&Primvar<'a>>,
        width: usize,
        instead: &str,
        report: &mut Report,
    ) -> Option<Channel<'a>> {
        let primvar = primvar?;
        let found = match self.channel(primvar) {
            Ok(channel) if channel.width == width => return Some(channel),
            Ok(channel) => format!("has {} floats a value, expected {width}", channel.width),
            Err(what) => what,
        };
        report.warn(path, primvar.name, format_args!("{found}; {instead}"));
        None
    }
}
