//! Paths that leave records of the light that they found.

use kilauea_bsdf::BsdfSample;
use kilauea_gather::{Arrival, ChoiceRecords, GatherRecord};
use kilauea_math::{Spectrum, Vec3};

use super::Guide;
use super::guided::{Guided, Known};
use crate::integrator::{PathSample, RayTally};
use crate::light::{ByCells, CellWalk, LightChooser, Lights, Receiver};

/// Guides by what earlier paths found, if there were any, and notes what paths find.
#[derive(Clone, Copy)]
pub(crate) struct Training<'a> {
    pub(crate) guide: Option<Guided<'a>>,
    pub(crate) notes: Notes,
}

/// What paths note.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Notes {
    /// From where light came.
    pub(crate) directions: bool,
    /// Which lights were chosen, by paths that are not told which to choose.
    pub(crate) lights: bool,
}

/// A path's vertices, until it is known what light they received.
#[derive(Debug, Default)]
pub(crate) struct PathTrail {
    pixel: [i32; 2],
    notes: Notes,
    /// Scattering whose vertex has not added its own light yet.
    pending: Option<TrailVertex>,
    vertices: Vec<TrailVertex>,
    /// Light of the sample when a light was chosen for which it is not known yet what it brings.
    sought: Option<f32>,
    /// Lights that this path and those before it chose.
    pub(crate) choices: ChoiceRecords,
}

/// Where a path went on in one of many directions.
#[derive(Clone, Copy, Debug)]
struct TrailVertex {
    receiver: Receiver,
    wi: Vec3,
    pdf: f32,
    /// Fraction of light along `wi` that arrives at the camera.
    throughput: Spectrum,
    /// Light of the sample before the path went on.
    gathered: Spectrum,
}

impl<'a> LightChooser for Training<'a> {
    type Walk = CellWalk<'a>;

    #[inline]
    fn walk(&self, receiver: Receiver) -> CellWalk<'a> {
        let lights = self.guide.map_or(ByCells::BLIND, |guide| guide.lights);
        lights.walk(receiver)
    }
}

impl<'a> Guide for Training<'a> {
    const AIMS_BY_MIRRORS: bool = false;

    type Knowledge = Known<'a>;
    type Trail = PathTrail;

    fn begin(&self, trail: &mut PathTrail, pixel: [i32; 2]) {
        trail.pixel = pixel;
        trail.notes = self.notes;
    }

    #[inline]
    fn at(&self, receiver: Receiver) -> Known<'a> {
        self.guide
            .map_or(Known::NOTHING, |guide| guide.at(receiver))
    }

    fn seek(
        trail: &mut PathTrail,
        lights: &Lights,
        receiver: Receiver,
        light: u32,
        out: &PathSample,
    ) {
        if !trail.notes.lights {
            return;
        }
        let Receiver { p, n } = receiver;
        let turns = lights.turns_to(light, receiver);
        // Without turns there is no choice.
        if !turns.is_empty() {
            trail.choices.push([p, n], trail.pixel, &turns);
            trail.sought = Some(out.light().luminance());
        }
    }

    fn leave(
        trail: &mut PathTrail,
        receiver: Receiver,
        sample: Option<&BsdfSample>,
        arriving: Spectrum,
    ) {
        if !trail.notes.directions {
            return;
        }
        trail.pending = sample.filter(|s| !s.is_delta).map(|sample| TrailVertex {
            receiver,
            wi: sample.wi,
            pdf: sample.pdf,
            throughput: arriving * sample.weight(),
            gathered: Spectrum::BLACK,
        });
    }

    fn depart(trail: &mut PathTrail, out: &PathSample) {
        if let Some(before) = trail.sought.take() {
            trail
                .choices
                .set_last_brought(out.light().luminance() - before);
        }
        if let Some(vertex) = trail.pending.take() {
            trail.vertices.push(TrailVertex {
                gathered: out.light(),
                ..vertex
            });
        }
    }
}

impl PathTrail {
    /// Ends the path: adds what its vertices learnt to `records`.
    pub(crate) fn end(&mut self, out: &PathSample, records: &mut Vec<GatherRecord>) {
        let (pixel, light) = (self.pixel, out.light());
        records.extend(self.vertices.drain(..).map(|vertex| {
            let Receiver { p, n } = vertex.receiver;
            let brought = (light - vertex.gathered).luminance();
            let seen = vertex.throughput.luminance();
            let irradiance = if seen > 0.0 {
                (brought / seen * vertex.wi.dot(n).abs() / vertex.pdf).max(0.0)
            } else {
                0.0
            };
            GatherRecord {
                p,
                n,
                arrival: Arrival {
                    wi: vertex.wi,
                    irradiance,
                    pdf: vertex.pdf,
                },
                pixel,
                brought,
            }
        }));
    }
}

pub(crate) fn n_rays(counts: &RayTally) -> u64 {
    u64::from(counts.shadow) + u64::from(counts.indirect)
}
