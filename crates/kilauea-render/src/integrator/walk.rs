//! A path from vertex to vertex: the ray that is being traced, and what it knows of those before.

use kilauea_accel::{Ray, Visibility};
use kilauea_bsdf::SeenBsdf;
use kilauea_math::hash::unit_f32;
use kilauea_math::{Spectrum, Vec3};
use std::mem::take;

use super::cone::RayCone;
use super::guide::{Guide, Knowledge};
use super::media::{Boundary, Media};
use super::path_light::PathLight;
use super::path_sample::PathSample;
use super::roulette;
use super::throughput::Throughput;
use crate::geometry::{Geometry, Interaction};
use crate::light::{Emitted, Emitter, Receiver};
use crate::sampler::{Purpose, Sampler};

/// Rougher lobes leave bright spots to rays that are aimed at lights.
const MAX_NARROW_ROUGHNESS: f32 = 0.25;

/// A path on its way.
#[derive(Clone, Copy)]
pub(crate) struct Path<M, E = ()> {
    /// From where the path scattered last; what lies before `t_min` is passed already.
    pub(super) ray: Ray,
    pub(super) cone: RayCone,
    /// The vertex that the ray left; none of the camera's ray.
    pub(super) departure: Option<Departure>,
    /// Whether a ray is aimed at what a mirror shows where the path has arrived.
    pub(super) aims_by_mirror: bool,
    pub(super) throughput: Throughput,
    pub(super) media: M,
    /// What merging with photons needs to know of the way so far.
    pub(super) eye: E,
}

/// The vertex that a ray left, as far as multiple importance sampling needs it.
#[derive(Clone, Copy)]
pub(crate) struct Departure {
    pub(super) receiver: Receiver,
    /// Density of the direction; irrelevant where no light sampling could have found it.
    pub(super) pdf: f32,
    pub(super) is_delta: bool,
    /// Whether light from infinity along the ray is known by another ray that was aimed.
    pub(super) has_aimed: bool,
}

impl Departure {
    /// The same where the direction counts as drawn with another density.
    pub(super) fn with_pdf(self, pdf: f32) -> Self {
        Self { pdf, ..self }
    }
}

/// A ray on its way from a vertex.
#[derive(Clone, Copy)]
pub(crate) struct Segment<'a> {
    pub(super) departure: &'a Departure,
    pub(super) ray: &'a Ray,
}

impl Segment<'_> {
    /// Density with which the vertex connects to where the ray meets a light, by number, at a distance: by
    /// what surfaces and lights are like alone.
    pub(super) fn connect_pdf(self, emitter: &Emitter<'_>, light: u32, distance: f32) -> f32 {
        let receiver = self.departure.receiver;
        if self.departure.is_delta {
            0.0
        } else {
            emitter.connection_pdf(light, receiver, self.ray.dir, distance)
        }
    }

    /// Weight of meeting a light that connecting finds with the density `connect_pdf`, where the direction
    /// counts as drawn with `pdf`.
    pub(super) fn weight_beside_connecting(self, pdf: f32, connect_pdf: f32) -> f32 {
        if self.departure.is_delta {
            1.0
        } else {
            power_heuristic(pdf, connect_pdf)
        }
    }
}

/// Where a path scatters.
pub(crate) struct Vertex<'a, M> {
    /// Scattering events before.
    pub(super) depth: u32,
    pub(super) interaction: Interaction<'a>,
    /// Fraction of light that passed on the way from the vertex before.
    pub(super) passed: Spectrum,
    /// None on surfaces that bound no medium.
    pub(super) boundary: Option<Boundary<M>>,
}

impl<M> Vertex<'_, M> {
    /// Whether photons never arrive here, as rays from other surfaces do not.
    pub(super) fn is_hidden_from_photons(&self, geometry: &Geometry) -> bool {
        let met_by = geometry.met_by(self.interaction.at);
        met_by & kilauea_scene::Visibility::INDIRECT == kilauea_scene::Visibility::NONE
    }

    /// The point as lights see it.
    #[inline]
    pub(super) fn receiver(&self) -> Receiver {
        let surface = &self.interaction.surface;
        Receiver {
            p: surface.p,
            n: if surface.ns.dot(surface.wo) < 0.0 {
                -surface.ns
            } else {
                surface.ns
            },
        }
    }
}

impl<M: Media, E> Path<M, E> {
    /// Where light sampling could have found what the ray meets.
    #[inline]
    pub(super) fn receiver(&self) -> Option<Receiver> {
        self.departure.filter(|d| !d.is_delta).map(|d| d.receiver)
    }

    /// The way from the last vertex; none from the camera.
    #[inline]
    pub(super) fn segment(&self) -> Option<Segment<'_>> {
        let departure = self.departure.as_ref()?;
        let ray = &self.ray;
        Some(Segment { departure, ray })
    }

    /// Chooses where the path goes on, and whether it does; `contrast` is how much brighter than others
    /// a direction is, so that it is not ended before bright light as if it brought little.
    #[inline]
    pub(super) fn scatter<G: Guide>(
        &mut self,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
        sampler: &Sampler<'_>,
        (knowledge, trail): (&G::Knowledge, &mut G::Trail),
        contrast: impl FnOnce(Vec3) -> f32,
    ) -> PathLight {
        let depth = vertex.depth;
        let u_lobe = if bsdf.has_one_lobe() && !knowledge.chooses_directions() {
            0.5
        } else {
            sampler.pair(Purpose::Choice(depth)).y
        };
        let u_direction = sampler.pair(Purpose::Direction(depth));
        let u = [u_lobe, u_direction.x, u_direction.y];
        let drawn = knowledge.sample(bsdf, u);
        let sample = drawn.as_ref().map(|drawn| &drawn.sample);
        let throughput = &mut self.throughput;
        let receiver = vertex.receiver();
        let arriving = throughput.arriving(depth) * vertex.passed;
        G::leave(trail, receiver, sample, arriving);
        let Some(drawn) = drawn else {
            return PathLight::NOTHING;
        };
        let sample = &drawn.sample;
        throughput.scatter(
            depth,
            sample.diffuse * vertex.passed,
            sample.specular * vertex.passed,
        );
        let has_aimed = take(&mut self.aims_by_mirror) && sample.is_mirrored();
        self.departure = Some(Departure {
            receiver,
            pdf: sample.pdf,
            is_delta: sample.is_delta,
            has_aimed,
        });
        if !sample.is_delta {
            self.cone.scatter(sample.roughness);
        }

        // End dim paths by chance.
        let undimmed = throughput.total(depth) * G::undimmed(trail, &drawn);
        let mut survival = roulette::survival(depth, undimmed);
        if survival < 1.0 && sample.roughness < MAX_NARROW_ROUGHNESS && !has_aimed {
            survival = roulette::survival(depth, undimmed * contrast(sample.wi));
        }
        if survival < 1.0 {
            if unit_f32(sampler.key(0x8000_0000 | depth)) >= survival {
                return PathLight::NOTHING;
            }
            throughput.scale_last(depth, Spectrum::splat(1.0 / survival));
        } else if throughput.total(depth).is_black() {
            return PathLight::NOTHING;
        }
        if sample.is_transmission
            && let Some(boundary) = &vertex.boundary
        {
            self.media.cross(boundary);
        }
        self.media.depart();
        let interaction = &vertex.interaction;
        self.ray = interaction.spawn_ray(sample.wi, f32::INFINITY, Visibility::INDIRECT);
        PathLight::BY_PATH
    }

    /// Adds emission met by the ray, which left its vertex after `depth` events, of which the
    /// fraction `passed` arrives. `weight` stands for that of multiple importance sampling, if there
    /// is one.
    #[inline]
    pub(super) fn add_emitted(
        &self,
        out: &mut PathSample,
        depth: u32,
        emitted: &Emitted,
        passed: Spectrum,
        weight: Option<f32>,
    ) {
        let radiance = emitted.radiance * passed;
        let Some(departure) = self.departure else {
            if emitted.visible_to_camera {
                out.emission += radiance;
            }
            return;
        };
        let weight = match weight {
            Some(weight) => weight,
            None if departure.is_delta => 1.0,
            None => power_heuristic(departure.pdf, emitted.pdf),
        };
        let radiance = radiance * weight;
        let [diffuse, specular] = self.throughput.last_by_lobes();
        self.throughput.add(
            out,
            depth,
            radiance * (diffuse * emitted.diffuse),
            radiance * (specular * emitted.specular),
        );
    }
}

/// Veach's power heuristic with exponent two, for one sample of each strategy.
#[inline]
pub(crate) fn power_heuristic(pdf: f32, other_pdf: f32) -> f32 {
    if pdf == f32::INFINITY {
        return 1.0;
    }
    // The ratio first: squares of large densities overflow.
    let ratio = other_pdf / pdf;
    1.0 / (1.0 + ratio * ratio)
}
