//! Pixels in which mirrors, glass or narrow lobes show a small bright light: a glint is smaller than a
//! pixel, or ends within one, and only the pixel's own samples find it.

use kilauea_accel::{Ray, Visibility};
use kilauea_bsdf::{BsdfSample, SeenBsdf};
use kilauea_math::Vec3;
use kilauea_spot::{Context, Program};

use super::fault::Watch;
use super::guide::Guide;
use super::media::Media;
use super::merge::Merge;
use super::path::PathIntegrator;
use super::question::{Answer, Question};
use super::ray_counts::RayTally;
use crate::sampler::Sampler;

/// A ray from the camera over surfaces that show what is behind them.
#[derive(Clone, Copy, Default)]
struct Sight {
    /// Where the last of them shows what is there, whether or not something is in between.
    shown: Option<Shown>,
    /// Whether the first surface lets light through as well.
    shines_through: bool,
}

#[derive(Clone, Copy)]
struct Shown {
    dir: Vec3,
    /// About how much lobes on the way blur it.
    blur: f32,
}

/// Which side of the first surface is looked at.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Reflected,
    Through,
}

/// Rougher lobes are found by light samples.
const MAX_ROUGHNESS: f32 = 0.1;
/// Surfaces that are looked over at most.
const MAX_SURFACES: u32 = 6;
/// Farther apart, directions through corners of a pixel belong to different surfaces.
const MAX_SPREAD: f32 = 0.5;
/// Closer together, they belong to a surface that hardly bends.
const FLAT: f32 = 0.1;
/// What is between the corners may reach a little beyond.
const MARGIN: f32 = 1.25;
/// Numbers that choose each lobe of a surface: unlikely ones are first and last.
const LOBE_NUMBERS: [f32; 11] = [
    0.004, 0.02, 0.06, 0.15, 0.3, 0.5, 0.7, 0.85, 0.94, 0.98, 0.996,
];

impl<const CUTOUTS: bool, M: Media, G: Guide, X: Merge, W: Watch>
    PathIntegrator<'_, CUTOUTS, M, G, X, W>
{
    /// Whether a pixel may see a glint, told by camera rays through its center and its corners: they
    /// bound what is between them. Samples do not depend on it, so their mean does not either.
    pub(crate) async fn may_glint<P, C>(
        &self,
        [center, corners @ ..]: [Ray; 5],
        sampler: &Sampler<'_>,
        counts: &mut RayTally,
        cx: &C,
    ) -> bool
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        for side in [Side::Reflected, Side::Through] {
            let seen = self.look(center, side, sampler, counts, cx).await;
            if let Some(at_center) = seen.shown {
                let mut spread = at_center.blur;
                let mut n_apart = 0;
                for corner in corners {
                    let beside = self.look(corner, side, sampler, counts, cx).await;
                    let Some(beside) = beside.shown else {
                        continue;
                    };
                    let distance = beside.dir.distance(at_center.dir);
                    if distance > MAX_SPREAD {
                        n_apart += 1;
                        continue;
                    }
                    spread = spread.max(at_center.blur + distance);
                    if distance <= FLAT && !self.is_toward_sun(at_center.dir, MAX_SPREAD) {
                        break;
                    }
                }
                if n_apart >= 2 || self.is_toward_sun(at_center.dir, MARGIN * spread) {
                    return true;
                }
            }
            if !seen.shines_through {
                break;
            }
        }
        false
    }

    fn is_toward_sun(&self, dir: Vec3, distance: f32) -> bool {
        let suns = self.lights.suns().iter();
        suns.map(|sun| sun.distance_squared(dir))
            .any(|d| d <= distance * distance)
    }

    async fn look<P, C>(
        &self,
        mut ray: Ray,
        side: Side,
        sampler: &Sampler<'_>,
        counts: &mut RayTally,
        cx: &C,
    ) -> Sight
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let mut seen = Sight::default();
        let mut blur = 0.0;
        for depth in 0..MAX_SURFACES {
            let count = if depth == 0 {
                &mut counts.camera
            } else {
                &mut counts.indirect
            };
            *count += 1;
            let asked = cx.ask(Question::closest::<CUTOUTS>(&ray, sampler, depth));
            let (hit, carried) = asked.await.hit();
            let Some(hit) = hit else { break };
            let interaction = self.interaction((&hit, carried.as_deref()), &ray, 0.0);
            let surface = &interaction.surface;
            let shading = self.blame.shading(interaction.at);
            let bsdf = interaction.shader.bsdf(surface).seen_from(surface.wo);
            drop(shading);
            let [reflected, through] = narrow_lobes(&bsdf);
            if depth == 0 {
                seen.shines_through = reflected.is_some() && through.is_some();
            }
            let chosen = match (reflected, through) {
                (Some(reflected), Some(through)) => {
                    let goes_through = if depth == 0 {
                        side == Side::Through
                    } else {
                        through.pdf > reflected.pdf
                    };
                    Some(if goes_through { through } else { reflected })
                }
                (reflected, through) => reflected.or(through),
            };
            let Some(sample) = chosen else { break };
            blur += 4.0 * sample.roughness * sample.roughness;
            ray = interaction.spawn_ray(sample.wi, f32::INFINITY, Visibility::INDIRECT);
            seen.shown = Some(Shown { dir: ray.dir, blur });
        }
        seen
    }
}

/// Where a surface shows what is before it, and what is behind it.
fn narrow_lobes(bsdf: &SeenBsdf) -> [Option<BsdfSample>; 2] {
    let mut lobes = [None; 2];
    if bsdf.probability_of_rough(MAX_ROUGHNESS) >= 1.0 {
        return lobes;
    }
    for u in LOBE_NUMBERS {
        if let Some(sample) = bsdf.sample([u, 0.5, 0.5])
            && sample.roughness < MAX_ROUGHNESS
        {
            lobes[usize::from(sample.is_transmission)].get_or_insert(sample);
        }
    }
    lobes
}
