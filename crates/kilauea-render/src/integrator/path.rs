//! Unbiased path tracing with next-event estimation and multiple importance sampling
//! (Kajiya 1986; Veach & Guibas 1995).

use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_bsdf::SeenBsdf;
use kilauea_film::PixelSample;
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Spectrum, Vec2};
use kilauea_texture::TextureStore;

use crate::camera::{CameraRay, RayGenerator};
use crate::geometry::{Geometry, Interaction, View};
use crate::light::{Emitted, Lights, Receiver};
use crate::needs::SceneNeeds;
use crate::sampler::{Purpose, Sampler};

/// The path integrator.
#[derive(Clone, Copy)]
pub(crate) struct PathIntegrator<'a> {
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

/// Width of the bundle that a ray stands for: a sample's share of a pixel, spread by rough bounces.
#[derive(Clone, Copy)]
struct RayCone {
    width: f32,
    spread: f32,
}

/// Throughput, split at the first vertex so that each layer gets its share.
#[derive(Clone, Copy)]
struct Throughput {
    /// Weights of the first scattering event.
    first_diffuse: Spectrum,
    first_specular: Spectrum,
    /// Product of all later events but the last.
    between: Spectrum,
    /// Weights of the last event.
    last_diffuse: Spectrum,
    last_specular: Spectrum,
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

impl PathIntegrator<'_> {
    /// Radiance along a camera ray, and what the first surface there is like.
    ///
    /// `CUTOUTS` is whether any surface lets rays pass: the general loop with `CUTOUTS` and the
    /// special one without give the same image where none does.
    pub(crate) fn trace<const CUTOUTS: bool>(
        &self,
        camera_ray: &CameraRay,
        camera: &RayGenerator,
        sampler: &Sampler<'_>,
        counts: &mut RayCounts,
    ) -> PixelSample {
        let mut out = PixelSample::default();
        let mut ray = camera_ray.ray;
        let mut cone = RayCone::of_camera_ray(camera, self.samples_per_pixel);
        let mut departure: Option<Departure> = None;
        let mut throughput = Throughput::start();
        counts.camera += 1;

        for depth in 0..=self.max_depth {
            let hit = self.closest::<CUTOUTS>(&ray, sampler, depth);
            // Only what hits nothing can be invalid, so that the others need no look.
            if hit.is_none() {
                counts.invalid += u64::from(!ray.is_valid());
            }

            // Add what lights emit along the ray.
            let t_end = hit.map_or(ray.t_max, |h| h.t);
            let receiver = departure.filter(|d| !d.is_delta).map(|d| d.receiver);
            let mut add = |emitted: Emitted| {
                add_emitted(&mut out, &throughput, depth, departure.as_ref(), &emitted);
            };
            if self.needs.area_lights {
                let segment = Ray {
                    t_max: t_end,
                    ..ray
                };
                self.lights
                    .for_each_area_hit(&segment, receiver, self.textures, &mut add);
            }
            let Some(hit) = hit else {
                if self.needs.infinite_lights {
                    self.lights
                        .for_each_infinite(ray.dir, receiver, self.textures, &mut add);
                }
                break;
            };
            cone.width += cone.spread * hit.t;
            let interaction = self.interaction(&hit, &ray, cone.width);
            if self.needs.mesh_lights
                && let Some(emitted) = self
                    .lights
                    .emitted_by_surface(&interaction, hit.t, receiver)
            {
                add(emitted);
            }
            if depth == 0 {
                self.describe_surface(
                    &mut out,
                    &interaction,
                    hit.t / camera_ray.distance_per_depth,
                );
            }
            if depth == self.max_depth {
                break;
            }

            let surface = &interaction.surface;
            let bsdf = interaction.shader.bsdf(surface);
            let has_smooth_lobes = bsdf.has_smooth_lobes();
            let bsdf = bsdf.seen_from(surface.wo);
            if depth == 0 {
                out.albedo = bsdf.albedo();
            }
            throughput.advance(depth);
            let receiver = Receiver {
                p: surface.p,
                n: if surface.ns.dot(surface.wo) < 0.0 {
                    -surface.ns
                } else {
                    surface.ns
                },
            };

            // Estimate direct light by choosing a light.
            if self.needs.lights && has_smooth_lobes {
                self.add_direct::<CUTOUTS>(
                    &mut out,
                    &throughput,
                    depth,
                    &interaction,
                    &bsdf,
                    receiver,
                    sampler,
                    counts,
                );
            }

            // Choose where the path goes on.
            let u_lobe = if bsdf.has_one_lobe() {
                0.5
            } else {
                sampler.pair(Purpose::Choice(depth)).y
            };
            let u_direction = sampler.pair(Purpose::Direction(depth));
            let u = [u_lobe, u_direction.x, u_direction.y];
            let Some(sample) = bsdf.sample(u) else {
                break;
            };
            throughput.scatter(depth, sample.diffuse, sample.specular);
            departure = Some(Departure {
                receiver,
                pdf: sample.pdf,
                is_delta: sample.is_delta,
            });
            if !sample.is_delta {
                cone.spread = cone.spread.max(ROUGH_SPREAD * sample.roughness);
            }

            // End dim paths by chance.
            if depth + 1 >= MIN_ROULETTE_DEPTH {
                let survival = throughput.total(depth).max_channel();
                if survival < 1.0 {
                    let survival = survival.max(0.05);
                    if unit_f32(sampler.key(0x8000_0000 | depth)) >= survival {
                        break;
                    }
                    throughput.scale_last(depth, 1.0 / survival);
                }
            } else if throughput.total(depth).is_black() {
                break;
            }
            ray = interaction.spawn_ray(sample.wi, f32::INFINITY, Visibility::INDIRECT);
            counts.indirect += 1;
        }
        out.beauty = out.emission
            + out.direct_diffuse
            + out.direct_specular
            + out.indirect_diffuse
            + out.indirect_specular;
        out
    }

    /// Next-event estimation at a vertex.
    fn add_direct<const CUTOUTS: bool>(
        &self,
        out: &mut PixelSample,
        throughput: &Throughput,
        depth: u32,
        interaction: &Interaction<'_>,
        bsdf: &SeenBsdf<'_>,
        receiver: Receiver,
        sampler: &Sampler<'_>,
        counts: &mut RayCounts,
    ) {
        // A single light needs no choice.
        let u_choice = if self.lights.len() > 1 {
            sampler.pair(Purpose::Choice(depth)).x
        } else {
            0.5
        };
        let u_light = sampler.pair(Purpose::Light(depth));
        let chosen = self
            .lights
            .sample(receiver, u_choice, u_light, self.geometry, self.textures);
        let Some(light) = chosen else { return };
        let sample = &light.sample;
        let eval = bsdf.eval(sample.wi);
        let (diffuse, specular) = (eval.diffuse * light.diffuse, eval.specular * light.specular);
        if diffuse.is_black() && specular.is_black() {
            return;
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
        counts.shadow += 1;
        if self.occluded::<CUTOUTS>(&shadow_ray, sampler, depth) {
            return;
        }
        counts.invalid += u64::from(!shadow_ray.is_valid());
        let weight = if sample.is_delta {
            1.0
        } else {
            power_heuristic(sample.pdf, eval.pdf)
        };
        let radiance = sample.radiance * (weight / sample.pdf);
        throughput.add(out, depth + 1, radiance, diffuse, specular);
    }

    fn describe_surface(&self, out: &mut PixelSample, interaction: &Interaction<'_>, z: f32) {
        let (prim_id, instance_id) = self.geometry.ids(interaction.at);
        out.alpha = 1.0;
        out.n = interaction.surface.ns;
        out.p = interaction.surface.p;
        out.z = z;
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

    #[inline]
    fn closest<const CUTOUTS: bool>(
        &self,
        ray: &Ray,
        sampler: &Sampler<'_>,
        depth: u32,
    ) -> Option<Hit> {
        let accel = self.geometry.accel();
        if CUTOUTS {
            let key = sampler.key(2 * depth);
            accel.intersect_filtered(ray, |hit| self.is_present(hit, ray, key))
        } else {
            accel.intersect(ray)
        }
    }

    #[inline]
    fn occluded<const CUTOUTS: bool>(&self, ray: &Ray, sampler: &Sampler<'_>, depth: u32) -> bool {
        let accel = self.geometry.accel();
        if CUTOUTS {
            let key = sampler.key(2 * depth + 1);
            accel.occluded_filtered(ray, |hit| self.is_present(hit, ray, key))
        } else {
            accel.occluded(ray)
        }
    }

    /// Whether a surface stops a ray. Partial presence is decided by a number that depends on the
    /// ray and the primitive alone, so it does not matter in which order a tree offers candidates,
    /// or whether twice.
    fn is_present(&self, hit: &Hit, ray: &Ray, key: u32) -> bool {
        let at = self.geometry.locate(hit);
        let shader = self.geometry.shader(at);
        if shader.is_opaque() {
            return true;
        }
        let view = View {
            uv: Vec2::new(hit.u, hit.v),
            p_ray: ray.at(hit.t),
            wo: -ray.dir.normalize(),
            time: ray.time,
            footprint: 0.0,
        };
        let interaction = self.geometry.interaction(at, &view, self.textures);
        let opacity = shader.opacity(&interaction.surface);
        let primitive_key = combine(hit.primitive, hit.instance);
        opacity >= 1.0 || unit_f32(combine(key, primitive_key)) < opacity
    }
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

impl Throughput {
    fn start() -> Self {
        Self {
            first_diffuse: Spectrum::ONE,
            first_specular: Spectrum::ONE,
            between: Spectrum::ONE,
            last_diffuse: Spectrum::ONE,
            last_specular: Spectrum::BLACK,
        }
    }

    /// Arrives at the vertex after `depth` events: the last one becomes one of those between.
    fn advance(&mut self, depth: u32) {
        if depth >= 2 {
            self.between *= self.last_diffuse + self.last_specular;
        }
    }

    /// Scatters at the vertex after `depth` events.
    fn scatter(&mut self, depth: u32, diffuse: Spectrum, specular: Spectrum) {
        if depth == 0 {
            (self.first_diffuse, self.first_specular) = (diffuse, specular);
        }
        (self.last_diffuse, self.last_specular) = (diffuse, specular);
    }

    /// Product of all events up to the one at the vertex after `depth` events.
    fn total(&self, depth: u32) -> Spectrum {
        let last = self.last_diffuse + self.last_specular;
        if depth == 0 {
            last
        } else {
            (self.first_diffuse + self.first_specular) * self.between * last
        }
    }

    fn scale_last(&mut self, depth: u32, factor: f32) {
        self.last_diffuse *= factor;
        self.last_specular *= factor;
        if depth == 0 {
            self.first_diffuse *= factor;
            self.first_specular *= factor;
        }
    }

    /// Adds light that arrives after `n_events` events, of which the last has the given weights.
    #[inline]
    fn add(
        &self,
        out: &mut PixelSample,
        n_events: u32,
        radiance: Spectrum,
        last_diffuse: Spectrum,
        last_specular: Spectrum,
    ) {
        if n_events == 1 {
            out.direct_diffuse += radiance * last_diffuse;
            out.direct_specular += radiance * last_specular;
        } else {
            let radiance = radiance * self.between * (last_diffuse + last_specular);
            out.indirect_diffuse += radiance * self.first_diffuse;
            out.indirect_specular += radiance * self.first_specular;
        }
    }
}

/// Adds emission met by a ray that left the vertex `departure` after `depth` events.
fn add_emitted(
    out: &mut PixelSample,
    throughput: &Throughput,
    depth: u32,
    departure: Option<&Departure>,
    emitted: &Emitted,
) {
    let Some(departure) = departure else {
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
    throughput.add(
        out,
        depth,
        emitted.radiance * weight,
        throughput.last_diffuse * emitted.diffuse,
        throughput.last_specular * emitted.specular,
    );
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
