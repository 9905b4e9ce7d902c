//! Points by the rules of UsdGeomPoints, as spheres.

use kilauea_math::{DAffine3, DVec3};
use kilauea_scene::{Attribute, Interpolation, PointsChunk};
use rayon::prelude::*;

use crate::channel::{Channel, Counts, Domain};
use crate::chunks::{ChunkSettings, zero_what_is_not_finite};
use crate::motion::later_keys_of;
use crate::payload::Points;
use crate::polygon::check_primvars;
use crate::report::Report;
use crate::surface::{is_placeable, mean_scale};

/// Width of points that have none authored.
const DEFAULT_WIDTH: f32 = 1.0;

/// The prim's points in pieces of a bounded number. Points without extent are not drawn.
pub(crate) fn build_points(
    prim: &Points<'_>,
    prototype_from_points: DAffine3,
    settings: &ChunkSettings<'_>,
    report: &mut Report,
) -> Vec<PointsChunk> {
    let counts = Counts {
        points: prim.points.len(),
        faces: 1,
        corners: prim.points.len(),
    };
    let keys = later_keys_of(prim.path, prim.points, &prim.later_points, report);
    let widths = widths(prim, counts, report);
    let channels = check_primvars(prim.path, &prim.primvars, counts, report);
    let radius_scale = 0.5 * mean_scale(prim.path, &prototype_from_points, report);
    let radius = |i: u32| radius_scale * widths.as_ref().map_or(DEFAULT_WIDTH, |w| at(w, i)[0]);
    let place = |p: [f32; 3]| {
        let p = DVec3::from_array(p.map(f64::from));
        prototype_from_points.transform_point3(p)
    };

    let all_keys = || std::iter::once(prim.points).chain(keys.iter().copied());
    let is_finite = |i: u32| all_keys().all(|key| is_placeable(place(key[i as usize])));
    let (finite, not_finite): (Vec<u32>, Vec<u32>) =
        (0..prim.points.len() as u32).partition(|&i| is_finite(i));
    if !not_finite.is_empty() {
        let what = format_args!("{} points are not finite; not drawn", not_finite.len());
        report.warn(prim.path, "points", what);
    }
    let n_bad_widths = finite
        .iter()
        .filter(|&&i| !(radius(i) >= 0.0 && radius(i) < f32::MAX));
    let n_bad_widths = n_bad_widths.count();
    if n_bad_widths > 0 {
        let what = format_args!("{n_bad_widths} are negative or not finite; points not drawn");
        report.warn(prim.path, "widths", what);
    }
    let has_extent = |&i: &u32| radius(i) > 0.0 && radius(i) < f32::MAX;
    let drawn: Vec<u32> = finite.into_iter().filter(has_extent).collect();

    let overrides = settings.overrides;
    let is_overridden = |c: &&Channel<'_>| overrides.iter().any(|o| o.name == c.name);
    let chunk = |piece: &[u32]| {
        let centers = |key: &[[f32; 3]]| {
            let relative = |&i: &u32| place(key[i as usize]) - settings.center;
            piece
                .iter()
                .map(|i| relative(i).as_vec3().to_array())
                .collect()
        };
        let own = channels.iter().filter(|c| !is_overridden(c));
        PointsChunk {
            prim_idx: settings.prim_idx,
            material: prim.material,
            centers: centers(prim.points),
            later_centers: keys.iter().map(|key| centers(key)).collect(),
            radii: piece.iter().map(|&i| radius(i)).collect(),
            attributes: own
                .map(|channel| gather(channel, piece))
                .chain(overrides.iter().cloned())
                .collect(),
            visibility: settings.visibility,
        }
    };
    let pieces = drawn.par_chunks(settings.max_primitives.max(1));
    let mut chunks: Vec<PointsChunk> = pieces.map(chunk).collect();
    let attributes = chunks.iter_mut().flat_map(|c| &mut c.attributes);
    zero_what_is_not_finite(prim.path, attributes, report);
    chunks
}

fn widths<'a>(prim: &Points<'a>, counts: Counts, report: &mut Report) -> Option<Channel<'a>> {
    let what = match Channel::from_primvar(prim.widths.as_ref()?, counts) {
        Ok(channel) if channel.width == 1 => return Some(channel),
        Ok(channel) => format!("has {} floats a value, expected 1", channel.width),
        Err(what) => what,
    };
    report.warn(prim.path, "widths", format_args!("{what}; 1 instead"));
    None
}

fn at<'c>(channel: &'c Channel<'_>, point: u32) -> &'c [f32] {
    match channel.domain {
        Domain::Constant | Domain::Face => channel.value(0),
        Domain::Point | Domain::Corner => channel.value(point),
    }
}

fn gather(channel: &Channel<'_>, piece: &[u32]) -> Attribute {
    let (interpolation, data) = match channel.domain {
        Domain::Constant | Domain::Face => (Interpolation::Constant, channel.value(0).to_vec()),
        Domain::Point | Domain::Corner => {
            let values = piece.iter().flat_map(|&i| channel.value(i));
            (Interpolation::Vertex, values.copied().collect())
        }
    };
    Attribute {
        name: channel.name.to_owned(),
        width: channel.width as u8,
        interpolation,
        data,
    }
}
