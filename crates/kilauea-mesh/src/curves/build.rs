use kilauea_math::{DAffine3, DVec3, Vec3};
use kilauea_scene::{Attribute, CurveBasis, CurveProfile, CurvesChunk, Interpolation};
use rayon::prelude::*;

use super::stencil::{CurveStencils, Stencil};
use super::{CheckedCurves, Curve};
use crate::channel::{Channel, Domain};
use crate::chunks::{ChunkSettings, zero_what_is_not_finite};
use crate::motion::later_keys_of;
use crate::payload::BasisCurves;
use crate::report::Report;
use crate::surface::mean_scale;
use crate::tokens::CurveType;

/// Width of curves and points that have none authored.
const DEFAULT_WIDTH: f32 = 1.0;

/// The prim's curves in pieces of a bounded number of segments.
pub(crate) fn build_curves(
    prim: &BasisCurves<'_>,
    checked: &CheckedCurves,
    prototype_from_curves: DAffine3,
    settings: &ChunkSettings<'_>,
    report: &mut Report,
) -> Vec<CurvesChunk> {
    let builder = Builder {
        checked,
        material: prim.material,
        keys: later_keys_of(prim.path, prim.points, &prim.later_points, report),
        points: prim.points,
        widths: checked.attribute(prim.path, prim.widths.as_ref(), 1, "1 instead", report),
        normals: checked.attribute(prim.path, prim.normals.as_ref(), 3, "tubes", report),
        channels: channels(prim, checked, report),
        prototype_from_curves,
        radius_scale: 0.5 * mean_scale(prim.path, &prototype_from_curves, report),
        settings,
    };
    let groups = groups_of_curves(&checked.curves, settings.max_primitives);
    let built: Vec<(CurvesChunk, bool)> = groups
        .into_par_iter()
        .map(|curves| builder.chunk(curves))
        .collect();
    if built.iter().any(|(_, has_bad_widths)| *has_bad_widths) {
        let what = "negative or not finite in places; zero instead";
        report.warn(prim.path, "widths", what);
    }
    let mut chunks: Vec<CurvesChunk> = built.into_iter().map(|(chunk, _)| chunk).collect();
    let attributes = chunks.iter_mut().flat_map(|c| &mut c.attributes);
    zero_what_is_not_finite(prim.path, attributes, report);
    chunks
}

fn channels<'a>(
    prim: &BasisCurves<'a>,
    checked: &CheckedCurves,
    report: &mut Report,
) -> Vec<Channel<'a>> {
    let mut channels: Vec<Channel<'a>> = Vec::with_capacity(prim.primvars.len());
    for primvar in &prim.primvars {
        match checked.channel(primvar) {
            Ok(channel) => channels.push(channel),
            Err(what) => {
                let what = format_args!("{what}; primvar ignored");
                report.warn(prim.path, &format!("primvars:{}", primvar.name), what);
            }
        }
    }
    channels
}

/// Consecutive curves of at most `limit` segments together, or a single longer one.
fn groups_of_curves(curves: &[Curve], limit: usize) -> Vec<&[Curve]> {
    let mut groups = Vec::new();
    let (mut first, mut n_segments) = (0, 0);
    for (i, curve) in curves.iter().enumerate() {
        if i > first && n_segments + curve.n_segments > limit {
            groups.push(&curves[first..i]);
            (first, n_segments) = (i, 0);
        }
        n_segments += curve.n_segments;
    }
    if first < curves.len() {
        groups.push(&curves[first..]);
    }
    groups
}

struct Builder<'p, 'a> {
    checked: &'p CheckedCurves,
    material: u32,
    points: &'a [[f32; 3]],
    /// Points at the later motion keys.
    keys: &'p [&'a [[f32; 3]]],
    widths: Option<Channel<'a>>,
    normals: Option<Channel<'a>>,
    channels: Vec<Channel<'a>>,
    prototype_from_curves: DAffine3,
    radius_scale: f32,
    settings: &'p ChunkSettings<'p>,
}

/// The control points of a group of curves.
#[derive(Default)]
struct Controls {
    stencils: CurveStencils,
    /// Number of the curve that each control point belongs to.
    curve_of_point: Vec<u32>,
    /// First control point of each segment.
    segments: Vec<u32>,
    curve_of_segment: Vec<u32>,
}

impl Builder<'_, '_> {
    /// A piece, and whether some of its widths had to be replaced.
    fn chunk(&self, curves: &[Curve]) -> (CurvesChunk, bool) {
        let controls = self.controls(curves);
        let vertex = &controls.stencils.vertex;
        let mut has_bad_widths = false;
        let radii = (0..vertex.len())
            .map(|i| {
                let width = self.widths.as_ref().map_or(DEFAULT_WIDTH, |channel| {
                    let [width] = value_at(channel, &controls, i);
                    width
                });
                let is_bad = !(width.is_finite() && width >= 0.0);
                // Splines through narrow ends may swing below zero: that is no fault of the widths.
                has_bad_widths |= is_bad && self.widths_are_bad(&controls, i);
                self.radius_scale * if is_bad { 0.0 } else { width }
            })
            .collect();
        let points = self.placed(self.points, vertex);
        let normals = self
            .normals
            .as_ref()
            .map(|channel| self.ribbon_normals(channel, &controls, &points));
        let overrides = self.settings.overrides;
        let is_overridden = |c: &&Channel<'_>| overrides.iter().any(|o| o.name == c.name);
        let own = self.channels.iter().filter(|c| !is_overridden(c));
        let chunk = CurvesChunk {
            prim_idx: self.settings.prim_idx,
            material: self.material,
            later_points: self
                .keys
                .iter()
                .map(|key| self.placed(key, vertex))
                .collect(),
            points,
            radii,
            profile: match normals {
                None => CurveProfile::Round,
                Some(_) => CurveProfile::Ribbon,
            },
            normals,
            basis: match self.checked.kind.curve_type {
                CurveType::Linear => CurveBasis::Linear,
                CurveType::Cubic => CurveBasis::Bezier,
            },
            attributes: own
                .map(|channel| gather(channel, &controls))
                .chain(overrides.iter().cloned())
                .collect(),
            segments: controls.segments,
            visibility: self.settings.visibility,
        };
        (chunk, has_bad_widths)
    }

    fn controls(&self, curves: &[Curve]) -> Controls {
        let mut controls = Controls::default();
        for curve in curves {
            let first = controls.stencils.vertex.len();
            let mut stencils = self.checked.kind.stencils(
                curve.points.len(),
                curve.points.start as u32,
                curve.first_varying,
            );
            let step = (stencils.vertex.len() - 1) / curve.n_segments;
            for segment in 0..curve.n_segments {
                controls.segments.push((first + segment * step) as u32);
                controls.curve_of_segment.push(curve.idx);
            }
            let n_points = stencils.vertex.len();
            controls
                .curve_of_point
                .extend(std::iter::repeat_n(curve.idx, n_points));
            controls.stencils.vertex.append(&mut stencils.vertex);
            controls.stencils.varying.append(&mut stencils.varying);
        }
        controls
    }

    /// Control points in the prototype's space, relative to its center.
    fn placed(&self, points: &[[f32; 3]], stencils: &[Stencil]) -> Vec<[f32; 3]> {
        let control_point = |stencil: &Stencil| {
            let p = stencil.terms().fold(DVec3::ZERO, |sum, (i, weight)| {
                sum + f64::from(weight) * DVec3::from_array(points[i as usize].map(f64::from))
            });
            let p_prototype = self.prototype_from_curves.transform_point3(p);
            (p_prototype - self.settings.center).as_vec3().to_array()
        };
        stencils.iter().map(control_point).collect()
    }

    fn widths_are_bad(&self, controls: &Controls, point: usize) -> bool {
        let Some(channel) = &self.widths else {
            return false;
        };
        let is_bad = |w: f32| !(w.is_finite() && w >= 0.0);
        let stencil = stencil_at(channel, controls, point);
        stencil
            .terms()
            .any(|(element, _)| is_bad(channel.value(element)[0]))
    }

    /// Unit normals; across the curve where none is given.
    fn ribbon_normals(
        &self,
        channel: &Channel<'_>,
        controls: &Controls,
        points: &[[f32; 3]],
    ) -> Vec<[f32; 3]> {
        let matrix = self.prototype_from_curves.matrix3;
        let normal_from_curves = matrix.inverse().transpose().as_mat3();
        let normal = |i: usize| {
            let authored = Vec3::from_array(value_at(channel, controls, i));
            let n = (normal_from_curves * authored.normalize_or_zero()).normalize_or_zero();
            if n != Vec3::ZERO {
                return n.to_array();
            }
            let next = (i + 1).min(points.len() - 1);
            let along = Vec3::from_array(points[next]) - Vec3::from_array(points[i]);
            let along = along.try_normalize().unwrap_or(Vec3::X);
            along.any_orthonormal_vector().to_array()
        };
        (0..points.len()).map(normal).collect()
    }
}

/// Which elements of a channel make up its value at a control point.
fn stencil_at(channel: &Channel<'_>, controls: &Controls, point: usize) -> Stencil {
    match channel.domain {
        Domain::Constant => Stencil::alone(0),
        Domain::Face => Stencil::alone(controls.curve_of_point[point]),
        Domain::Point => controls.stencils.vertex[point],
        Domain::Corner => controls.stencils.varying[point],
    }
}

/// The value of a channel at a control point.
fn value_at<const N: usize>(channel: &Channel<'_>, controls: &Controls, point: usize) -> [f32; N] {
    let mut value = [0.0; N];
    for (element, weight) in stencil_at(channel, controls, point).terms() {
        let part = channel.value(element);
        value
            .iter_mut()
            .zip(part)
            .for_each(|(sum, x)| *sum += weight * x);
    }
    value
}

/// A primvar per control point, or per segment where it is given by curve.
fn gather(channel: &Channel<'_>, controls: &Controls) -> Attribute {
    let (interpolation, data) = match channel.domain {
        Domain::Constant => (Interpolation::Constant, channel.value(0).to_vec()),
        Domain::Face => (
            Interpolation::Uniform,
            controls
                .curve_of_segment
                .iter()
                .flat_map(|&curve| channel.value(curve))
                .copied()
                .collect(),
        ),
        Domain::Point | Domain::Corner => (
            Interpolation::Vertex,
            (0..controls.curve_of_point.len())
                .flat_map(|i| {
                    let value: [f32; 4] = value_at(channel, controls, i);
                    value.into_iter().take(channel.width)
                })
                .collect(),
        ),
    };
    Attribute {
        name: channel.name.to_owned(),
        width: channel.width as u8,
        interpolation,
        data,
    }
}
