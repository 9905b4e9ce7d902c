//! The media that the camera is in.

use kilauea_accel::{Ray, Visibility};
use kilauea_math::{Vec2, Vec3, warp};

use super::media::{Media, MediumStack};
use super::question::Question;
use super::rays::RayTracer;
use crate::geometry::View;

/// Odd, so that no two answers share the majority.
const N_PROBES: u32 = 7;
/// Surfaces that a probe passes at most.
const MAX_CROSSINGS: usize = 10_000;

/// Finds the media around a point by probes from infinity: each arrives with the boundaries on its
/// way crossed, and what most of them agree on is taken. Around closed meshes all agree; a sheet
/// with an edge, such as the pane of a window, is outvoted by the probes that miss it.
pub(crate) fn media_around(p: Vec3, rays: &RayTracer<'_, false>) -> MediumStack {
    let found: Vec<MediumStack> = (0..N_PROBES)
        .map(|i| {
            let u = Vec2::new((i as f32 + 0.5) / N_PROBES as f32, 0.618 * i as f32 % 1.0);
            probe(p, warp::uniform_sphere(u), rays)
        })
        .collect();
    let votes = |stack: &MediumStack| found.iter().filter(|other| *other == stack).count();
    let winner = found.iter().max_by_key(|stack| votes(stack));
    winner.copied().unwrap_or(MediumStack::AIR)
}

/// The media with which a path arrives at `p` that comes straight from infinity against `dir`.
fn probe(p: Vec3, dir: Vec3, rays: &RayTracer<'_, false>) -> MediumStack {
    let &RayTracer {
        geometry, textures, ..
    } = rays;
    let mut outward = Vec::new();
    let mut ray = Ray {
        visibility: Visibility::CAMERA,
        ..Ray::new(p, dir)
    };
    while outward.len() < MAX_CROSSINGS {
        let (hit, carried) = rays.answer_to(Question::Closest { ray, key: 0 }).hit();
        let Some(hit) = hit else { break };
        let view = View {
            uv: Vec2::new(hit.u, hit.v),
            p_ray: ray.at(hit.t),
            wo: -dir,
            time: ray.time,
            footprint: 0.0,
        };
        let at = geometry.locate(&hit);
        let interaction = match carried.as_deref() {
            None => geometry.interaction(at, &view, textures),
            Some(carried) => geometry.interaction_of_carried(at, carried, &view, textures),
        };
        outward.push((interaction.at, interaction.surface.ng.dot(dir) < 0.0));
        ray = interaction.spawn_ray(dir, f32::INFINITY, Visibility::CAMERA);
    }
    // What is left on the way out is entered on the way in.
    outward
        .into_iter()
        .rev()
        .filter(|(at, _)| geometry.shader(*at).interior().is_some())
        .fold(MediumStack::AIR, |stack, (at, is_entered_outward)| {
            let material = geometry.material(at);
            if is_entered_outward {
                stack.left(material)
            } else {
                stack.entered(geometry, material)
            }
        })
}
