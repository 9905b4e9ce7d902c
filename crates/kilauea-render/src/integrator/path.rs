//! Unbiased path tracing with next-event estimation and multiple importance sampling
//! (Kajiya 1986; Veach & Guibas 1995).

use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_bsdf::SeenBsdf;
use kilauea_film::PixelSample;
use kilauea_math::hash::unit_f32;
use kilauea_math::{Spectrum, Vec2};
use kilauea_spot::{Context, Program};
use kilauea_texture::TextureStore;

use super::blame::Blame;
use super::question::{Answer, Question};
use super::throughput::Throughput;
use crate::camera::{CameraRay, RayGenerator};
use crate::geometry::{Geometry, Interaction, View};
use crate::light::{Emitted, Lights, Receiver};
use crate::needs::SceneNeeds;
use crate::sampler::{Purpose, Sampler};

/// The path integrator. `CUTOUTS` as in [`super::RayTracer`], which it asks.
#[derive(Clone, Copy)]
pub(crate) struct PathIntegrator<'a, const CUTOUTS: bool> {
    /// Surfaces.
    pub geometry: &'a Geometry,
    /// Lights.
    pub lights: &'a Lights,
    /// Images.
    pub textures: &'a TextureStore,
    /// Scattering events after the camera; 0 is emission alone.
    pub max_depth: u32,
    /// Samples that a pixel is to get.
    pub samples_per_pixel: u32,
    /// What the scene uses; the rest is skipped.
    pub needs: SceneNeeds,
    /// Where a shader that panics leaves its name.
    pub blame: &'a Blame,
}

/// Rays traced, by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Toward lights.
    pub shadow: u64,
    /// Scattered.
    pub indirect: u64,
    /// Of all these, those that could not be traced.
    pub invalid: u64,
}

impl RayCounts {
    /// Adds the rays of others.
    pub(crate) fn add(&mut self, other: Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.indirect += other.indirect;
        self.invalid += other.invalid;
    }
}

/// A path on its way: the ray that is being traced, and what it knows of those before.
#[derive(Clone, Copy)]
struct Path {
    ray: Ray,
    cone: RayCone,
    /// The vertex that the ray left; none of the camera's ray.
    departure: Option<Departure>,
    throughput: Throughput,
}

/// What was asked at a vertex. `R` is an answer on its way.
struct Vertex<R> {
    direct: Option<Direct<R>>,
    /// What the path hits next; none where it ends.
    next: Option<R>,
}

/// Light of one light at a vertex, if nothing occludes it.
struct Direct<R> {
    occluded: R,
    /// Whether the ray to the light could be traced.
    is_valid: bool,
    radiance: Spectrum,
    /// Weights of the scattering toward the camera.
    diffuse: Spectrum,
    specular: Spectrum,
}

/// Width of the bundle that a ray stands for: a sample's share of a pixel, spread by rough bounces.
#[derive(Clone, Copy)]
struct RayCone {
    width: f32,
    spread: f32,
}

/// The vertex that a ray left, as far as multiple importance sampling needs it.
#[derive(Clone, Copy)]
struct Departure {
    receiver: Receiver,
    /// Density of the direction; irrelevant where no light sampling could have found it.
    pdf: f32,
    is_delta: bool,
}

/// Paths may end by Russian roulette after this many scattering events.
const MIN_ROULETTE_DEPTH: u32 = 3;
/// Shadow rays end this much before the light.
const SHADOW_T_MAX: f32 = 1.0 - 1e-4;
/// Least width of a camera ray's bundle, in pixels.
const MIN_PIXEL_FOOTPRINT: f32 = 0.125;
/// Spread in radians of the bundle behind a fully rough bounce. Textures seen that way may be
/// blurred without harm, and then fewer of their tiles are read.
const ROUGH_SPREAD: f32 = 0.1;

impl<const CUTOUTS: bool> PathIntegrator<'_, CUTOUTS> {
    /// Radiance along a camera ray, and what the first surface there is like.
    ///
    /// What rays meet is asked of `cx`; all else is done here.
    #[inline]
    pub(crate) async fn trace<P, C>(
        &self,
        camera_ray: &CameraRay,
        camera: &RayGenerator,
        sampler: &Sampler<'_>,
        counts: &mut RayCounts,
        cx: &C,
    ) -> PixelSample
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let mut out = PixelSample::default();
        let mut path = Path {
            ray: camera_ray.ray,
            cone: RayCone::of_camera_ray(camera, self.samples_per_pixel),
            departure: None,
            throughput: Throughput::start(),
        };
        counts.camera += 1;
        let mut closest = cx.ask(closest::<CUTOUTS>(&path.ray, sampler, 0));

        for depth in 0..=self.max_depth {
            let hit = closest.await.hit();
            // Only what hits nothing can be invalid, so that the others need no look.
            if hit.is_none() {
                counts.invalid += u64::from(!path.ray.is_valid());
            }
            let t_end = hit.map_or(path.ray.t_max, |h| h.t);
            self.add_area_lights(&mut out, &path, depth, t_end);
            let Some(hit) = hit else {
                self.add_infinite_lights(&mut out, &path, depth);
                break;
            };
            if depth == 0 {
                out.z = hit.t / camera_ray.distance_per_depth;
            }
            // Ask for all that this vertex leads to ...
            let Vertex { mut direct, next } =
                self.shade(&mut out, &mut path, depth, &hit, sampler, cx);
            if let Some(direct) = &direct {
                counts.shadow += 1;
                counts.invalid += u64::from(!direct.is_valid);
            }
            counts.indirect += u64::from(next.is_some());
            // ... and only then wait.
            if let Some(direct) = &mut direct
                && !(&mut direct.occluded).await.is_occluded()
            {
                path.throughput.add(
                    &mut out,
                    depth + 1,
                    direct.radiance,
                    direct.diffuse,
                    direct.specular,
                );
            }
            let Some(next) = next else { break };
            closest = next;
        }
        out.beauty = out.emission
            + out.direct_diffuse
            + out.direct_specular
            + out.indirect_diffuse
            + out.indirect_specular;
        out
    }

    /// Adds the light of lamps that the ray meets before `t_end`.
    #[inline]
    fn add_area_lights(&self, out: &mut PixelSample, path: &Path, depth: u32, t_end: f32) {
        if !self.needs.area_lights {
            return;
        }
        let segment = Ray {
            t_max: t_end,
            ..path.ray
        };
        self.lights
            .for_each_area_hit(&segment, path.receiver(), self.textures, |emitted| {
                path.add_emitted(out, depth, &emitted);
            });
    }

    /// Adds the light of what surrounds the scene.
    #[inline]
    fn add_infinite_lights(&self, out: &mut PixelSample, path: &Path, depth: u32) {
        if !self.needs.infinite_lights {
            return;
        }
        self.lights
            .for_each_infinite(path.ray.dir, path.receiver(), self.textures, |emitted| {
                path.add_emitted(out, depth, &emitted);
            });
    }

    /// Adds what the surface that was hit emits, and asks what its light and the rest of the path
    /// depend on. Moves `path` on.
    #[inline]
    fn shade<P, C>(
        &self,
        out: &mut PixelSample,
        path: &mut Path,
        depth: u32,
        hit: &Hit,
        sampler: &Sampler<'_>,
        cx: &C,
    ) -> Vertex<C::Reply>
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        path.cone.width += path.cone.spread * hit.t;
        let interaction = self.interaction(hit, &path.ray, path.cone.width);
        let shading = self.blame.shading(self.geometry, interaction.at);
        if self.needs.mesh_lights
            && let Some(emitted) =
                self.lights
                    .emitted_by_surface(&interaction, hit.t, path.receiver())
        {
            path.add_emitted(out, depth, &emitted);
        }
        if depth == 0 {
            self.describe_surface(out, &interaction);
        }
        if depth == self.max_depth {
            return Vertex::END;
        }

        let surface = &interaction.surface;
        let bsdf = interaction.shader.bsdf(surface);
        drop(shading);
        let has_smooth_lobes = bsdf.has_smooth_lobes();
        let bsdf = bsdf.seen_from(surface.wo);
        if depth == 0 {
            out.albedo = bsdf.albedo();
        }
        path.throughput.advance(depth);
        let receiver = Receiver {
            p: surface.p,
            n: if surface.ns.dot(surface.wo) < 0.0 {
                -surface.ns
            } else {
                surface.ns
            },
        };
        let direct = if self.needs.lights && has_smooth_lobes {
            self.direct(depth, &interaction, &bsdf, receiver, sampler, cx)
        } else {
            None
        };
        let is_alive = path.scatter(depth, &interaction, &bsdf, receiver, sampler);
        let next = is_alive.then(|| cx.ask(closest::<CUTOUTS>(&path.ray, sampler, depth + 1)));
        Vertex { direct, next }
    }

    /// Estimates direct light by choosing a light (next-event estimation).
    #[inline]
    fn direct<P, C>(
        &self,
        depth: u32,
        interaction: &Interaction<'_>,
        bsdf: &SeenBsdf<'_>,
        receiver: Receiver,
        sampler: &Sampler<'_>,
        cx: &C,
    ) -> Option<Direct<C::Reply>>
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        // A single light needs no choice.
        let u_choice = if self.lights.len() > 1 {
            sampler.pair(Purpose::Choice(depth)).x
        } else {
            0.5
        };
        let u_light = sampler.pair(Purpose::Light(depth));
        let light =
            self.lights
                .sample(receiver, u_choice, u_light, self.geometry, self.textures)?;
        let sample = &light.sample;
        let eval = bsdf.eval(sample.wi);
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
        let weight = if sample.is_delta {
            1.0
        } else {
            power_heuristic(sample.pdf, eval.pdf)
        };
        Some(Direct {
            occluded: cx.ask(occluded::<CUTOUTS>(&shadow_ray, sampler, depth)),
            is_valid: shadow_ray.is_valid(),
            radiance: sample.radiance * (weight / sample.pdf),
            diffuse,
            specular,
        })
    }

    fn describe_surface(&self, out: &mut PixelSample, interaction: &Interaction<'_>) {
        let (prim_id, instance_id) = self.geometry.ids(interaction.at);
        out.alpha = 1.0;
        out.n = interaction.surface.ns;
        out.p = interaction.surface.p;
        out.prim_id = prim_id;
        out.instance_id = instance_id;
    }

    #[inline]
    fn interaction(&self, hit: &Hit, ray: &Ray, width: f32) -> Interaction<'_> {
        let at = self.geometry.locate(hit);
        let view = View {
            uv: Vec2::new(hit.u, hit.v),
            p_ray: ray.at(hit.t),
            wo: -ray.dir,
            time: ray.time,
            footprint: if self.needs.textures { width } else { 0.0 },
        };
        self.geometry.interaction(at, &view, self.textures)
    }
}

/// Asks what a ray hits first that reaches the vertex after `depth` events.
#[inline]
fn closest<const CUTOUTS: bool>(ray: &Ray, sampler: &Sampler<'_>, depth: u32) -> Question {
    Question::Closest {
        ray: *ray,
        key: if CUTOUTS { sampler.key(2 * depth) } else { 0 },
    }
}

/// Asks whether anything is between the vertex after `depth` events and a light.
#[inline]
fn occluded<const CUTOUTS: bool>(ray: &Ray, sampler: &Sampler<'_>, depth: u32) -> Question {
    Question::Occluded {
        ray: *ray,
        key: if CUTOUTS {
            sampler.key(2 * depth + 1)
        } else {
            0
        },
    }
}

impl Path {
    /// Where light sampling could have found what the ray meets.
    #[inline]
    fn receiver(&self) -> Option<Receiver> {
        self.departure.filter(|d| !d.is_delta).map(|d| d.receiver)
    }

    /// Chooses where the path goes on; false where it ends.
    #[inline]
    fn scatter(
        &mut self,
        depth: u32,
        interaction: &Interaction<'_>,
        bsdf: &SeenBsdf<'_>,
        receiver: Receiver,
        sampler: &Sampler<'_>,
    ) -> bool {
        let u_lobe = if bsdf.has_one_lobe() {
            0.5
        } else {
            sampler.pair(Purpose::Choice(depth)).y
        };
        let u_direction = sampler.pair(Purpose::Direction(depth));
        let u = [u_lobe, u_direction.x, u_direction.y];
        let Some(sample) = bsdf.sample(u) else {
            return false;
        };
        let throughput = &mut self.throughput;
        throughput.scatter(depth, sample.diffuse, sample.specular);
        self.departure = Some(Departure {
            receiver,
            pdf: sample.pdf,
            is_delta: sample.is_delta,
        });
        if !sample.is_delta {
            self.cone.spread = self.cone.spread.max(ROUGH_SPREAD * sample.roughness);
        }

        // End dim paths by chance.
        if depth + 1 >= MIN_ROULETTE_DEPTH {
            let survival = throughput.total(depth).max_channel();
            if survival < 1.0 {
                let survival = survival.max(0.05);
                if unit_f32(sampler.key(0x8000_0000 | depth)) >= survival {
                    return false;
                }
                throughput.scale_last(depth, 1.0 / survival);
            }
        } else if throughput.total(depth).is_black() {
            return false;
        }
        self.ray = interaction.spawn_ray(sample.wi, f32::INFINITY, Visibility::INDIRECT);
        true
    }

    /// Adds emission met by the ray, which left its vertex after `depth` events.
    #[inline]
    fn add_emitted(&self, out: &mut PixelSample, depth: u32, emitted: &Emitted) {
        let Some(departure) = self.departure else {
            if emitted.visible_to_camera {
                out.emission += emitted.radiance;
            }
            return;
        };
        let weight = if departure.is_delta {
            1.0
        } else {
            power_heuristic(departure.pdf, emitted.pdf)
        };
        let throughput = &self.throughput;
        throughput.add(
            out,
            depth,
            emitted.radiance * weight,
            throughput.last_diffuse * emitted.diffuse,
            throughput.last_specular * emitted.specular,
        );
    }
}

impl<R> Vertex<R> {
    const END: Self = Self {
        direct: None,
        next: None,
    };
}

impl RayCone {
    /// As wide as camera rays are apart (PBR 4ed., 10.1.1): the pixel's filter is in their
    /// positions, and a wider bundle would blur textures, and flatten normal maps, once more.
    fn of_camera_ray(camera: &RayGenerator, samples_per_pixel: u32) -> Self {
        let pixels = (samples_per_pixel as f32).sqrt().recip();
        let pixels = pixels.max(MIN_PIXEL_FOOTPRINT);
        Self {
            width: pixels * camera.pixel_width(0.0),
            spread: pixels * (camera.pixel_width(1.0) - camera.pixel_width(0.0)),
        }
    }
}

/// Veach's power heuristic with exponent two, for one sample of each strategy.
#[inline]
fn power_heuristic(pdf: f32, other_pdf: f32) -> f32 {
    if pdf == f32::INFINITY {
        return 1.0;
    }
    // The ratio first: squares of large densities overflow.
    let ratio = other_pdf / pdf;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::{DMat4, DVec3};
    use kilauea_scene::{Camera, Projection};

    #[test]
    fn camera_rays_are_as_wide_as_their_share_of_a_pixel() {
        let camera = Camera {
            path: "/cam".into(),
            world_from_camera: DMat4::IDENTITY,
            later_world_from_camera: Vec::new(),
            shutter: [0.0; 2],
            projection: Projection::Perspective,
            screen_window: [-0.5, -0.5, 0.5, 0.5],
            lens_radius: 0.0,
            focus_distance: 0.0,
            clipping_range: [0.1, 100.0],
            exposure_scale: 1.0,
        };
        let camera = RayGenerator::new(&camera, [100, 100], DVec3::ZERO);
        let width = |samples| RayCone::of_camera_ray(&camera, samples).spread * 100.0;
        for (samples, expected) in [(1, 1.0), (16, 0.25), (10_000, 0.125)] {
            assert!((width(samples) - expected).abs() < 1e-5, "{samples}");
        }
    }
}
