//! Unbiased path tracing with next-event estimation and multiple importance sampling
//! (Kajiya 1986; Veach & Guibas 1995).

use kilauea_accel::{Hit, Ray};
use kilauea_bsdf::{Mirror, SeenBsdf};
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_spot::{Context, Program};
use kilauea_texture::TextureStore;
use std::marker::PhantomData;
use std::pin::pin;

use super::blame::Blame;
use super::cone::RayCone;
use super::fault::{Step, Unwatched, Watch};
use super::guide::{Guide, Unguided};
use super::media::{Media, is_hidden};
use super::merge::{Merge, Unmerged};
use super::path_sample::PathSample;
use super::question::{Answer, Question};
use super::ray_counts::RayTally;
use super::shade::PathShade;
use super::throughput::Throughput;
use super::walk::{Path, Vertex};
use crate::geometry::{Carried, Geometry, Interaction, PrimitiveRef, View};
use crate::light::{Emitted, Lights};
use crate::needs::SceneNeeds;
use crate::sampler::Sampler;

/// The path integrator. `CUTOUTS` as in [`super::RayTracer`], which it asks; `M` is what paths keep
/// of the media around them.
#[derive(Clone, Copy)]
pub(crate) struct PathIntegrator<
    'a,
    const CUTOUTS: bool,
    M,
    G = Unguided,
    X = Unmerged,
    W = Unwatched,
> {
    /// Surfaces.
    pub geometry: &'a Geometry,
    /// Lights.
    pub lights: &'a Lights,
    /// Images.
    pub textures: &'a TextureStore,
    /// Scattering events after the camera; 0 is emission alone.
    pub max_depth: u32,
    /// Of each camera ray.
    pub camera_cone: RayCone,
    /// What the scene uses; the rest is skipped.
    pub needs: SceneNeeds,
    /// Whether those who are asked bring tiles of textures.
    pub asks_for_tiles: bool,
    /// The media that the camera is in.
    pub camera_media: M,
    /// What paths know beforehand of the light that they look for.
    pub guide: G,
    /// How paths share what they find with photons.
    pub merge: X,
    /// Where a shader that panics leaves its name.
    pub blame: &'a Blame,
    /// Sees the values of paths.
    pub watch: W,
}

impl<'a, const CUTOUTS: bool, M: Media, G: Guide, X: Merge> PathIntegrator<'a, CUTOUTS, M, G, X> {
    /// The same integrator, whose paths merge with photons.
    pub(crate) fn merging_by<Y: Merge>(&self, merge: Y) -> PathIntegrator<'a, CUTOUTS, M, G, Y> {
        self.with(self.guide, merge, Unwatched)
    }

    /// The same integrator with another guide.
    pub(crate) fn guided_by<H: Guide>(&self, guide: H) -> PathIntegrator<'a, CUTOUTS, M, H, X> {
        self.with(guide, self.merge, Unwatched)
    }

    /// The same integrator, under watch.
    pub(crate) fn watched_by<W: Watch>(&self, watch: W) -> PathIntegrator<'a, CUTOUTS, M, G, X, W> {
        self.with(self.guide, self.merge, watch)
    }

    fn with<H: Guide, Y: Merge, W: Watch>(
        &self,
        guide: H,
        merge: Y,
        watch: W,
    ) -> PathIntegrator<'a, CUTOUTS, M, H, Y, W> {
        PathIntegrator {
            geometry: self.geometry,
            lights: self.lights,
            textures: self.textures,
            max_depth: self.max_depth,
            camera_cone: self.camera_cone,
            needs: self.needs,
            asks_for_tiles: self.asks_for_tiles,
            camera_media: self.camera_media,
            guide,
            merge,
            blame: self.blame,
            watch,
        }
    }
}

impl<'a, const CUTOUTS: bool, M: Media, G: Guide, X: Merge, W: Watch>
    PathIntegrator<'a, CUTOUTS, M, G, X, W>
{
    /// A path that starts with a ray of the camera.
    #[inline]
    pub(crate) fn start(&self, camera_ray: Ray) -> Path<M, X::Eye> {
        Path {
            ray: camera_ray,
            cone: self.camera_cone,
            departure: None,
            aims_by_mirror: false,
            throughput: Throughput::start(),
            media: self.camera_media,
            eye: self.merge.start(),
        }
    }

    /// Radiance along a path, and what the first surface there is like.
    ///
    /// What rays meet is asked of `cx`; all else is done here. A shader ends before the path that
    /// it asked for: each turn of the loop is the rest of the shade before.
    ///
    /// The first question is sent at once. Not an `async fn`, which would keep each argument in two
    /// places while it waits.
    #[inline]
    pub(crate) fn trace<P, C>(
        &self,
        mut path: Path<M, X::Eye>,
        sampler: Sampler<'_>,
        counts: &mut RayTally,
        trail: &mut G::Trail,
        cx: &C,
    ) -> impl Future<Output = PathSample>
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        self.watch.see(Step::CameraRay, 0, None, || {
            path.ray.origin.is_finite() && path.ray.dir.is_finite()
        });
        counts.camera += 1;
        self.guide.set_out(trail);
        let mut next = Some(cx.ask(Question::closest::<CUTOUTS>(&path.ray, &sampler, 0)));
        async move {
            let mut out = PathSample::new();
            let mut depth = 0;
            while let Some(asked) = &mut next {
                let (hit, carried) = asked.await.hit();
                let carried = carried.as_deref();
                next = None;
                let hit = self.meet(&mut out, &path, depth, hit, counts);
                let Some(hit) = hit else { break };
                if let Some(ray) = self.pass_hidden_boundary(&mut path, &hit, carried) {
                    counts.indirect += 1;
                    next = Some(cx.ask(Question::closest::<CUTOUTS>(&ray, &sampler, depth)));
                    continue;
                }
                if C::WAITS && self.asks_for_tiles {
                    let absent = self.absent_tiles(&path, (&hit, carried));
                    if !absent.is_empty() {
                        // In a box, as room for it would be in the state of every path.
                        Box::pin(self.bring_tiles(absent, &path, (&hit, carried), cx)).await;
                    }
                }
                let (vertex, knowledge) = self.arrive(&mut out, &mut path, depth, (&hit, carried));
                if depth == self.max_depth {
                    break;
                }
                path.throughput.advance(depth);
                let (shader, at) = (vertex.interaction.shader, vertex.interaction.at);
                let mut asked = X::Asked::default();
                let scattered = {
                    let shading = self.blame.shading(at);
                    let shade = pin!(shader.shade(PathShade {
                        integrator: self,
                        vertex,
                        path: &mut path,
                        knowledge,
                        trail: &mut *trail,
                        sampler: &sampler,
                        counts,
                        out: &mut out,
                        next: &mut next,
                        asked: &mut asked,
                        cx,
                        program: PhantomData,
                    }));
                    drop(shading);
                    self.blame.watch(at, shade).await
                };
                self.merge.receive(&mut path.eye, &mut asked).await;
                path.throughput
                    .add(&mut out, depth + 1, scattered.diffuse, scattered.specular);
                if let Some([diffuse, specular]) = X::take(&mut path.eye) {
                    let [diffuse, specular] = [diffuse, specular].map(|l| l * scattered.path);
                    path.throughput
                        .add_indirect(&mut out, depth, diffuse, specular);
                }
                G::depart(trail, &out);
                if scattered.path.is_black() {
                    break;
                }
                if scattered.path != Spectrum::ONE {
                    path.throughput.scale_last(depth, scattered.path);
                }
                depth += 1;
            }
            counts.in_too_many_media += u32::from(path.media.has_overflowed());
            self.watch
                .see(Step::Sum, self.max_depth, None, || out.light().is_finite());
            out
        }
    }

    /// Adds the light of lights that the ray meets before the surface that it hit. Returns where
    /// that is, from where the path scattered last.
    #[inline(always)]
    fn meet(
        &self,
        out: &mut PathSample,
        path: &Path<M, X::Eye>,
        depth: u32,
        hit: Option<Hit>,
        counts: &mut RayTally,
    ) -> Option<Hit> {
        let hit = hit.map(|hit| path.media.since_departure(hit));
        let t_end = hit.map_or(path.ray.t_max, |h| h.t);
        self.add_area_lights(out, path, depth, t_end);
        if hit.is_none() {
            // Only what hits nothing can be invalid, so that the others need no look.
            counts.invalid += u32::from(!path.ray.is_valid());
            self.add_infinite_lights(out, path, depth);
        }
        hit
    }

    /// Adds the light of lamps that the ray meets before `t_end`.
    #[inline]
    fn add_area_lights(
        &self,
        out: &mut PathSample,
        path: &Path<M, X::Eye>,
        depth: u32,
        t_end: f32,
    ) {
        if !self.needs.area_lights {
            return;
        }
        let segment = Ray {
            t_max: t_end,
            ..path.ray
        };
        self.lights.for_each_area_hit(
            &segment,
            path.receiver(),
            self.guide,
            self.textures,
            |t, emitted| {
                self.see_emitted(depth, None, &emitted);
                let passed = path.media.transmittance(self.geometry, t);
                let weight = self
                    .merge
                    .weight_of_hit(&path.eye, path.segment(), &emitted, t);
                path.add_emitted(out, depth, &emitted, passed, weight);
            },
        );
    }

    /// Adds the light of what surrounds the scene.
    #[inline]
    fn add_infinite_lights(&self, out: &mut PathSample, path: &Path<M, X::Eye>, depth: u32) {
        let is_known = path.departure.is_some_and(|d| d.has_aimed);
        if !self.needs.infinite_lights || is_known {
            return;
        }
        self.lights.for_each_infinite(
            path.ray.dir,
            path.receiver(),
            self.guide,
            self.textures,
            |emitted| {
                self.see_emitted(depth, None, &emitted);
                let passed = path.media.transmittance(self.geometry, f32::INFINITY);
                let weight =
                    self.merge
                        .weight_of_hit(&path.eye, path.segment(), &emitted, f32::INFINITY);
                path.add_emitted(out, depth, &emitted, passed, weight);
            },
        );
    }

    /// Where the hit is a boundary that is not there in the media around the path: goes on behind
    /// it, and returns the ray that finds what is next.
    #[inline]
    fn pass_hidden_boundary(
        &self,
        path: &mut Path<M, X::Eye>,
        hit: &Hit,
        carried: Option<&Carried>,
    ) -> Option<Ray> {
        let least_priority = path.media.least_priority(self.geometry);
        if least_priority == i8::MIN {
            return None;
        }
        let shader = self.geometry.shader(self.geometry.locate(hit));
        if !is_hidden(shader, least_priority) {
            return None;
        }
        let interaction = self.interaction((hit, carried), &path.ray, 0.0);
        let boundary = path.media.boundary(self.geometry, &interaction)?;
        if !boundary.is_hidden {
            return None;
        }
        path.media.pass(&boundary, hit.t);
        path.ray.t_min = hit.t;
        let Ray {
            dir,
            t_max,
            visibility,
            ..
        } = path.ray;
        Some(interaction.spawn_ray(dir, t_max - hit.t, visibility))
    }

    /// The vertex at a hit, and what is known of the light there. Adds what the surface emits.
    // So that it is made where it stays.
    #[inline(always)]
    fn arrive<'s>(
        &self,
        out: &mut PathSample,
        path: &mut Path<M, X::Eye>,
        depth: u32,
        (hit, carried): (&Hit, Option<&'s Carried>),
    ) -> (Vertex<'s, M>, G::Knowledge)
    where
        'a: 's,
    {
        path.cone.advance(hit.t);
        self.watch.see(Step::Hit, depth, None, || {
            Vec3::new(hit.t, hit.u, hit.v).is_finite()
        });
        let mut vertex = Vertex {
            depth,
            interaction: self.interaction((hit, carried), &path.ray, path.cone.width),
            passed: path.media.transmittance(self.geometry, hit.t),
            boundary: None,
        };
        let interaction = &mut vertex.interaction;
        let at = interaction.at;
        self.watch
            .see(Step::Surface, depth, Some(at), || interaction.is_finite());
        vertex.boundary = path.media.boundary(self.geometry, interaction);
        if let Some(boundary) = &vertex.boundary {
            interaction.surface.outside_ior = boundary.outside_ior;
        }
        if self.needs.mesh_lights {
            let _shading = self.blame.shading(at);
            let emitted =
                self.lights
                    .emitted_by_surface(interaction, hit.t, path.receiver(), self.guide);
            if let Some(emitted) = emitted {
                self.see_emitted(depth, Some(at), &emitted);
                let weight = self
                    .merge
                    .weight_of_hit(&path.eye, path.segment(), &emitted, hit.t);
                path.add_emitted(out, depth, &emitted, vertex.passed, weight);
            }
        }
        if depth == 0 {
            out.t = hit.t;
            if self.needs.surface_layers {
                self.describe_surface(out, interaction);
            }
        }
        // Here, as a vertex that was looked at would be kept for as long as its shade waits.
        let knowledge = self.guide.at(vertex.receiver());
        (vertex, knowledge)
    }

    /// The mirror by which a ray is aimed at a bright spot, if these lobes have one.
    #[inline]
    pub(super) fn glint(&self, bsdf: &SeenBsdf) -> Option<Mirror> {
        let is_looked_for = self.needs.glints && G::AIMS_BY_MIRRORS;
        is_looked_for
            .then(|| self.lights.glint(bsdf, self.textures))
            .flatten()
    }

    /// How many times brighter than on average light is that comes straight from a direction, as far
    /// as that is known.
    #[inline]
    pub(super) fn contrast(&self, dir: Vec3) -> f32 {
        if self.needs.glints {
            self.lights.spot_contrast(dir, self.textures)
        } else {
            1.0
        }
    }

    #[inline]
    fn see_emitted(&self, depth: u32, at: Option<PrimitiveRef>, emitted: &Emitted) {
        self.watch.see(Step::Emission, depth, at, || {
            emitted.radiance.is_finite() && !emitted.pdf.is_nan()
        });
    }

    fn describe_surface(&self, out: &mut PathSample, interaction: &Interaction<'_>) {
        let (prim_id, instance_id) = self.geometry.ids(interaction.at);
        out.n = interaction.surface.ns;
        out.p = interaction.surface.p;
        out.prim_id = prim_id;
        out.instance_id = instance_id;
    }

    #[inline]
    pub(super) fn interaction<'s>(
        &self,
        (hit, carried): (&Hit, Option<&'s Carried>),
        ray: &Ray,
        width: f32,
    ) -> Interaction<'s>
    where
        'a: 's,
    {
        let at = self.geometry.locate(hit);
        let view = View {
            uv: Vec2::new(hit.u, hit.v),
            p_ray: ray.at(hit.t),
            wo: -ray.dir,
            time: ray.time,
            footprint: if self.needs.textures { width } else { 0.0 },
        };
        let geometry = self.geometry;
        match carried {
            None => geometry.interaction(at, &view, self.textures),
            Some(carried) => geometry.interaction_of_carried(at, carried, &view, self.textures),
        }
    }
}
