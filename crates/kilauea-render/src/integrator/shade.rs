//! What a path tells a shader, and what becomes of the shader's questions.

use kilauea_accel::{Ray, Visibility};
use kilauea_bsdf::{Mirror, SeenBsdf};
use kilauea_math::{PackedSpectrum, Spectrum};
use kilauea_shading::{Scattered, Shade, Surface};
use kilauea_spot::{Context, Program};
use std::marker::PhantomData;
use std::pin::Pin;
use std::task::{self, Poll};

use super::fault::{Step, Watch};
use super::guide::{Guide, Knowledge};
use super::media::Media;
use super::merge::Merge;
use super::path::PathIntegrator;
use super::path_light::PathLight;
use super::path_sample::PathSample;
use super::question::{Answer, Question};
use super::ray_counts::RayTally;
use super::walk::{Path, Segment, Vertex, power_heuristic};
use crate::sampler::{Purpose, Sampler};

/// A path at a vertex, as the shader there sees it.
///
/// It owns the vertex, which so is gone once the shader has asked for all it wants to know: shades
/// that wait are many, and a vertex is large.
pub(super) struct PathShade<'v, 'a, P, C, M, G, X, W, const CUTOUTS: bool>
where
    P: Program,
    C: Context<P>,
    G: Guide,
    X: Merge,
{
    pub(super) integrator: &'v PathIntegrator<'a, CUTOUTS, M, G, X, W>,
    pub(super) vertex: Vertex<'v, M>,
    pub(super) path: &'v mut Path<M, X::Eye>,
    /// What is known of the light here.
    pub(super) knowledge: G::Knowledge,
    pub(super) trail: &'v mut G::Trail,
    pub(super) sampler: &'v Sampler<'v>,
    pub(super) counts: &'v mut RayTally,
    pub(super) out: &'v mut PathSample,
    /// What the path hits next; none where it ends.
    pub(super) next: &'v mut Option<C::Reply>,
    /// Light of photons that is asked for.
    pub(super) asked: &'v mut X::Asked<C::Reply, G::Knowledge>,
    pub(super) cx: &'v C,
    pub(super) program: PhantomData<P>,
}

/// The light of a light on its way. `R` is an answer.
struct DirectLight<R> {
    /// None where there is nothing to wait for.
    occluded: Option<R>,
    /// What lobes scatter of it toward the viewer, if nothing occludes it.
    diffuse: PackedSpectrum,
    specular: PackedSpectrum,
    /// Seldom there: in a box, as room for it would be in the state of every path.
    mirrored: Option<Box<MirroredLight<R>>>,
}

/// The light from infinity that a mirror shows, on its way.
struct MirroredLight<R> {
    occluded: R,
    /// What arrives at the viewer, if nothing occludes it.
    specular: Spectrum,
}

/// Shadow rays end this much before the light.
const SHADOW_T_MAX: f32 = 1.0 - 1e-4;

impl<R> DirectLight<R> {
    const NOTHING: Self = Self {
        occluded: None,
        diffuse: PackedSpectrum::BLACK,
        specular: PackedSpectrum::BLACK,
        mirrored: None,
    };
}

impl<R: Future<Output = Answer> + Unpin> Future for DirectLight<R> {
    type Output = Scattered;

    #[inline(always)]
    fn poll(mut self: Pin<&mut Self>, task: &mut task::Context<'_>) -> Poll<Scattered> {
        if let Some(occluded) = &mut self.occluded {
            let answer = task::ready!(Pin::new(occluded).poll(task));
            self.occluded = None;
            if answer.is_occluded() {
                self.diffuse = PackedSpectrum::BLACK;
                self.specular = PackedSpectrum::BLACK;
            }
        }
        let mut light = Scattered {
            diffuse: self.diffuse.unpack(),
            specular: self.specular.unpack(),
            ..Scattered::NOTHING
        };
        if let Some(mirrored) = &mut self.mirrored {
            let answer = task::ready!(Pin::new(&mut mirrored.occluded).poll(task));
            if !answer.is_occluded() {
                light.specular += mirrored.specular;
            }
        }
        Poll::Ready(light)
    }
}

impl<'v, 'a, P, C, M, G, X, W, const CUTOUTS: bool> Shade
    for PathShade<'v, 'a, P, C, M, G, X, W, CUTOUTS>
where
    P: Program<Question = Question, Answer = Answer>,
    C: Context<P>,
    M: Media,
    G: Guide,
    X: Merge,
    W: Watch,
{
    #[inline]
    fn surface(&self) -> &Surface<'_> {
        &self.vertex.interaction.surface
    }

    #[inline]
    fn direct_light(
        &mut self,
        bsdf: &SeenBsdf,
    ) -> impl Future<Output = Scattered> + Unpin + use<'v, 'a, P, C, M, G, X, W, CUTOUTS> {
        self.see_bsdf(bsdf);
        let glint = self.integrator.glint(bsdf);
        let merge = &self.integrator.merge;
        let lobes = (bsdf, glint.is_some());
        merge.look_up(self.path, &self.vertex, lobes, self.sampler);
        let mut light = self.sample_lights(bsdf).unwrap_or(DirectLight::NOTHING);
        if let Some(mirror) = glint {
            light.mirrored = self.aim_by_mirror(bsdf, &mirror);
        }
        light
    }

    // Inlined, it would move itself.
    #[inline(never)]
    fn indirect(
        mut self,
        bsdf: &SeenBsdf,
    ) -> impl Future<Output = Scattered> + Unpin + use<'v, 'a, P, C, M, G, X, W, CUTOUTS> {
        self.see_bsdf(bsdf);
        let (vertex, knowledge) = (&self.vertex, &self.knowledge);
        let merge = &self.integrator.merge;
        let (eye, lobes) = (&mut self.path.eye, (bsdf, knowledge));
        let ask = |question| self.cx.ask(question);
        let has_merged = merge.gather(eye, vertex, lobes, ask, self.asked);
        let mut light = self.go_on(bsdf);
        // What photons bring is a part of what the path brings, even if that ends here.
        light.goes_on |= has_merged;
        light
    }
}

impl<P, C, M, G, X, W, const CUTOUTS: bool> PathShade<'_, '_, P, C, M, G, X, W, CUTOUTS>
where
    P: Program<Question = Question, Answer = Answer>,
    C: Context<P>,
    M: Media,
    G: Guide,
    X: Merge,
    W: Watch,
{
    /// Estimates direct light by choosing a light (next-event estimation).
    #[inline]
    fn sample_lights(&mut self, bsdf: &SeenBsdf) -> Option<DirectLight<C::Reply>> {
        let &PathIntegrator {
            geometry,
            lights,
            textures,
            needs,
            ..
        } = self.integrator;
        let Vertex {
            depth,
            interaction,
            passed,
            ..
        } = &self.vertex;
        let mut others = None;
        let (lobes, rest_weight) = X::rest(&self.path.eye).lobes(bsdf, &mut others)?;
        if !needs.lights || !lobes.has_smooth_lobes() {
            return None;
        }
        let u_choice = if needs.light_choice {
            self.sampler.pair(Purpose::Choice(*depth)).x
        } else {
            0.5
        };
        let u_light = self.sampler.pair(Purpose::Light(*depth));
        let receiver = self.vertex.receiver();
        let picked = lights.choose(receiver, u_choice, self.integrator.guide)?;
        G::seek(self.trail, lights, receiver, picked.light, self.out);
        let light = lights.sample(picked, receiver, u_light, geometry, textures)?;
        let sample = &light.sample;
        let eval = lobes.eval(sample.wi);
        self.see(Step::LightSample, || {
            sample.wi.is_finite() && sample.radiance.is_finite() && !sample.pdf.is_nan()
        });
        self.see(Step::BsdfValue, || {
            eval.total().is_finite() && !eval.pdf.is_nan()
        });
        let (diffuse, specular) = (eval.diffuse * light.diffuse, eval.specular * light.specular);
        if diffuse.is_black() && specular.is_black() {
            return None;
        }
        let shadow_ray = if sample.distance == f32::INFINITY {
            interaction.spawn_ray(sample.wi, f32::INFINITY, Visibility::SHADOW)
        } else {
            // Aim from the moved origin at the chosen point.
            let target = interaction.surface.p + sample.wi * sample.distance;
            let ray = interaction.spawn_ray(sample.wi, SHADOW_T_MAX, Visibility::SHADOW);
            Ray {
                dir: target - ray.origin,
                ..ray
            }
        };
        let hit_pdf = if sample.is_delta {
            0.0
        } else {
            self.knowledge.pdf(lobes, sample.wi, eval.pdf)
        };
        let (merge, eye) = (&self.integrator.merge, &self.path.eye);
        let weight = power_heuristic(sample.pdf, hit_pdf);
        let (mut diffuse, mut specular) = (diffuse * weight, specular * weight);
        let lobes = (bsdf, &eval);
        let shared = merge.weight_of_connection(eye, &self.vertex, lobes, &light, hit_pdf);
        if let Some(shared) = shared {
            let more = shared.weight - weight;
            diffuse = (diffuse + shared.diffuse * (light.diffuse * more)).max(0.0);
            specular = (specular + shared.specular * (light.specular * more)).max(0.0);
        }
        self.counts.shadow += 1;
        self.counts.invalid += u32::from(!shadow_ray.is_valid());
        // Smooth lobes reflect, so the light comes through the medium in which the path came.
        let media = &self.path.media;
        let least_priority = media.least_priority(geometry);
        let unabsorbed = media.transmittance(geometry, sample.distance) * *passed;
        let radiance = sample.radiance * unabsorbed * (rest_weight / sample.pdf);
        self.see(Step::LightSample, || radiance.is_finite());
        let question =
            Question::occluded::<CUTOUTS>(&shadow_ray, least_priority, self.sampler, *depth);
        Some(DirectLight {
            occluded: Some(self.cx.ask(question)),
            diffuse: (radiance * diffuse).into(),
            specular: (radiance * specular).into(),
            mirrored: None,
        })
    }

    /// Looks from where a mirror is to what is at infinity there. The path need not find it again.
    #[inline(never)]
    fn aim_by_mirror(
        &mut self,
        bsdf: &SeenBsdf,
        mirror: &Mirror,
    ) -> Option<Box<MirroredLight<C::Reply>>> {
        let PathIntegrator {
            geometry,
            lights,
            textures,
            merge,
            guide,
            ..
        } = self.integrator;
        let (vertex, eye) = (&self.vertex, &self.path.eye);
        let mut others = None;
        let (_, rest_weight) = X::rest(eye).lobes(bsdf, &mut others)?;
        let mut radiance = Spectrum::BLACK;
        lights.for_each_infinite(mirror.wi, None, *guide, textures, |emitted| {
            let weight = merge.weight_of_mirrored(eye, vertex, mirror, emitted.light);
            radiance += emitted.radiance * (emitted.specular * weight.unwrap_or(1.0));
        });
        self.see(Step::LightSample, || radiance.is_finite());
        // As the path would go on: what hides the light from it is what rays of surfaces meet.
        let ray = vertex
            .interaction
            .spawn_ray(mirror.wi, f32::INFINITY, Visibility::INDIRECT);
        self.counts.shadow += 1;
        self.counts.invalid += u32::from(!ray.is_valid());
        let media = &self.path.media;
        let passed = media.transmittance(geometry, f32::INFINITY) * vertex.passed * rest_weight;
        let least_priority = media.least_priority(geometry);
        let question =
            Question::occluded::<CUTOUTS>(&ray, least_priority, self.sampler, vertex.depth);
        self.path.aims_by_mirror = true;
        Some(Box::new(MirroredLight {
            occluded: self.cx.ask(question),
            specular: radiance * mirror.reflectance * passed,
        }))
    }

    /// Chooses where the path goes on and asks what it hits there. All other light is known so far
    /// at once.
    #[inline]
    fn go_on(&mut self, bsdf: &SeenBsdf) -> PathLight {
        let depth = self.vertex.depth;
        let needs = &self.integrator.needs;
        if depth == 0 && needs.surface_layers {
            self.out.albedo = bsdf.albedo().into();
        }
        // All that the last ray could find is light.
        if depth + 1 == self.integrator.max_depth && !needs.met_lights() {
            return PathLight::NOTHING;
        }
        let mut others = None;
        let Some((lobes, weight)) = X::rest(&self.path.eye).lobes(bsdf, &mut others) else {
            return PathLight::NOTHING;
        };
        let (knowledge, trail) = (&self.knowledge, &mut *self.trail);
        let integrator = self.integrator;
        let light = self.path.scatter::<G>(
            &self.vertex,
            lobes,
            self.sampler,
            (knowledge, trail),
            |dir| integrator.contrast(dir),
        );
        self.see_scattered();
        if !light.goes_on {
            return light;
        }
        let path = &mut *self.path;
        if weight != 1.0 {
            path.throughput.scale_last(depth, Spectrum::splat(weight));
        }
        if let Some(departure) = &path.departure {
            let ray = &path.ray;
            let way = Segment { departure, ray };
            let (merge, eye) = (&self.integrator.merge, &mut path.eye);
            let shares = merge.depart(eye, way, &self.vertex, [bsdf, lobes], self.sampler);
            if shares != [Spectrum::ONE; 2] {
                path.throughput.scale_last_by_lobes(depth, shares);
            }
        }
        self.counts.indirect += 1;
        let question = Question::closest::<CUTOUTS>(&self.path.ray, self.sampler, depth + 1);
        *self.next = Some(self.cx.ask(question));
        light
    }

    #[inline]
    fn see(&self, step: Step, is_finite: impl FnOnce() -> bool) {
        let Vertex {
            depth, interaction, ..
        } = &self.vertex;
        let watch = self.integrator.watch;
        watch.see(step, *depth, Some(interaction.at), is_finite);
    }

    #[inline]
    fn see_bsdf(&self, bsdf: &SeenBsdf) {
        self.see(Step::Bsdf, || bsdf.albedo().is_finite());
    }

    #[inline]
    fn see_scattered(&self) {
        let throughput = &self.path.throughput;
        self.see(Step::BsdfSample, || {
            let [diffuse, specular] = throughput.last_by_lobes();
            (diffuse + specular).is_finite() && self.path.ray.dir.is_finite()
        });
        self.see(Step::Throughput, || {
            throughput.total(self.vertex.depth).is_finite()
        });
    }
}
