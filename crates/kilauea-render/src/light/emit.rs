//! Rays that leave lights, for tracing photons.
//!
//! All lights do the same: they choose a direction, then a point of their *cross-section*, the
//! shadow that they throw along it. Through a cross-section of area A, radiance L carries the power
//! L·A per solid angle, so a direction with the density p stands for the power L·A / p; the cosine
//! and the shape of the light are in A. The cross-section of infinitely distant light is that of
//! what it shines on.

use kilauea_accel::{Ray, Visibility};
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_texture::TextureStore;

use super::aim::{Target, UsefulRay, choice_by_use};
use super::light_choice::LightChoice;
use super::lit_box::LitBox;
use super::{InfiniteLight, Lights, Receiver};
use crate::geometry::Geometry;

/// A ray out of a light, and how it was chosen.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightRay {
    /// Where it starts.
    pub(super) p: Vec3,
    /// Unit direction.
    pub(super) dir: Vec3,
    /// Radiance along it.
    pub(super) radiance: Spectrum,
    /// Area perpendicular to the direction, over which rays start evenly; of light from infinity that
    /// is aimed, one over their density there.
    pub(super) cross_section: f32,
    /// Density of the direction per solid angle.
    pub(super) pdf_direction: f32,
    /// Whether no other direction is possible.
    pub(super) is_delta: bool,
    /// Distance within which nothing is met.
    pub(super) clearance: f32,
}

/// A ray that leaves a light.
struct Leaving {
    chosen: LightRay,
    ray: Ray,
    source: Option<u32>,
    /// For diffuse and for specular lobes.
    multipliers: [f32; 2],
}

/// A photon as it leaves a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmittedPhoton {
    /// The ray; it meets what holds light back, and what light scatters at.
    pub(crate) ray: Ray,
    /// Watts that it stands for; those of N photons are divided by N.
    pub(crate) power: Spectrum,
    /// Density with which it was chosen: per area perpendicular to the ray, and per solid angle
    /// unless the direction is the only one possible.
    pub(crate) density: f32,
    /// Whether it is.
    pub(crate) is_delta: bool,
    /// Which of [`Emitter::sources`] it leaves; none of light from infinity.
    pub(crate) source: Option<u32>,
    /// Number of the light: area lights, then triangles of emissive meshes, then lights at infinity.
    pub(crate) light: u32,
    /// Multiplies what diffuse lobes scatter of it where it arrives first.
    pub(crate) diffuse: f32,
    /// Multiplies what specular lobes scatter of it where it arrives first.
    pub(crate) specular: f32,
}

/// Sends photons out of the lights of a scene, each light with a probability in proportion to its
/// power.
pub(crate) struct Emitter<'a> {
    pub(super) lights: &'a Lights,
    pub(super) geometry: &'a Geometry,
    pub(super) textures: &'a TextureStore,
    /// None where there is nothing to shine on.
    pub(super) lit: Option<LitBox>,
    pub(super) choice: LightChoice,
    /// By source: area lights, emissive meshes, lights at infinity. Empty where nothing is aimed.
    targets: Vec<Target>,
}

impl<'a> Emitter<'a> {
    pub(crate) fn new(
        lights: &'a Lights,
        geometry: &'a Geometry,
        textures: &'a TextureStore,
    ) -> Self {
        let lit = LitBox::new(geometry.bounds());
        let area = lights.area.iter().map(|l| l.flux(textures).luminance());
        let infinite = lights.infinite.iter().map(|l| {
            lit.as_ref().map_or(0.0, |lit| match l {
                InfiniteLight::Distant(l) => {
                    l.irradiance().luminance() * lit.cross_section(l.direction())
                }
                InfiniteLight::Dome(l) => {
                    let radiance = l.mean_radiance().luminance();
                    4.0 * std::f32::consts::PI * radiance * lit.mean_cross_section()
                }
            })
        });
        let fluxes = area.chain(lights.mesh.fluxes(geometry)).chain(infinite);
        Self {
            choice: LightChoice::new(fluxes),
            lights,
            geometry,
            textures,
            lit,
            targets: Vec::new(),
        }
    }

    /// The same, with a share of the light aimed at what the light of earlier photons met that were of use.
    pub(crate) fn aimed_by(&self, rays: &[UsefulRay]) -> Self {
        let n_finite = self.sources().count();
        let n_sources = n_finite + self.lights.infinite.len();
        let n_lights = self.lights.len() as u32;
        let mut by_source = vec![Vec::new(); n_sources];
        for ray in rays {
            by_source[self.source(ray.light)].push(*ray);
        }
        let target = |(source, rays): (usize, &Vec<_>)| Target::of(rays, source >= n_finite);
        let source = |light| self.source(light);
        Self {
            choice: choice_by_use(&self.choice, n_lights, n_sources, source, rays),
            targets: by_source.iter().enumerate().map(target).collect(),
            ..*self
        }
    }

    /// Number of the source that a light belongs to, as `targets` has them.
    fn source(&self, light: u32) -> usize {
        let lights = self.lights;
        let n_area = lights.area.len();
        let n_mesh = lights.mesh.len();
        match (light as usize).checked_sub(n_area + n_mesh) {
            Some(idx) => n_area + lights.mesh.groups.len() + idx,
            None if (light as usize) < n_area => light as usize,
            None => n_area + lights.mesh.group_of(light) as usize,
        }
    }

    /// What a light is aimed at.
    pub(super) fn target(&self, light: u32) -> &Target {
        if self.targets.is_empty() {
            return &Target::Anywhere;
        }
        &self.targets[self.source(light)]
    }

    /// Points before all finite sources of light: area lights, then emissive meshes.
    pub(crate) fn sources(&self) -> impl Iterator<Item = Vec3> {
        let area = self.lights.area.iter().map(|light| light.center);
        area.chain(self.lights.mesh.points_before(self.geometry))
    }

    /// Area of the shadow of all surfaces, over all directions.
    pub(crate) fn mean_cross_section(&self) -> f32 {
        self.lit.as_ref().map_or(0.0, LitBox::mean_cross_section)
    }

    /// See [`Lights::connection_pdf`].
    pub(crate) fn connection_pdf(
        &self,
        light: u32,
        receiver: Receiver,
        wi: Vec3,
        distance: f32,
    ) -> f32 {
        self.lights
            .connection_pdf(light, receiver, wi, distance, self.geometry, self.textures)
    }

    /// Whether no photon can leave a light, or none could arrive.
    pub(crate) fn is_empty(&self) -> bool {
        self.lit.is_none() || self.choice.is_empty()
    }

    /// A photon; none where the light does not shine from the chosen point in the chosen direction.
    /// `u_light` is two numbers, as one has too few bits for millions of lights.
    pub(crate) fn emit(
        &self,
        u_light: Vec2,
        u_direction: Vec2,
        u_point: Vec2,
    ) -> Option<EmittedPhoton> {
        let (light, probability) = self.choice.sample(u_light)?;
        let leaving = self.leave(light, u_direction, u_point)?;
        let chosen = &leaving.chosen;
        let density = probability * chosen.pdf_direction / chosen.cross_section;
        // Photons carry no light that is less than none.
        let power = (chosen.radiance / density).max(0.0);
        let [diffuse, specular] = leaving.multipliers;
        (power.is_finite() && !power.is_black()).then_some(EmittedPhoton {
            ray: leaving.ray,
            power,
            density,
            is_delta: chosen.is_delta,
            source: leaving.source,
            light,
            diffuse,
            specular,
        })
    }

    fn leave(&self, light: u32, u_direction: Vec2, u_point: Vec2) -> Option<Leaving> {
        let Self {
            lights,
            geometry,
            textures,
            ..
        } = *self;
        let n_area = lights.area.len() as u32;
        if let Some(area) = lights.area.get(light as usize) {
            let cone = area.emission_cone();
            let direction = self.target(light).direction(
                u_direction,
                |u| cone.sample(u).0,
                |dir| cone.pdf(dir),
            );
            let chosen = area.emit(direction, u_point, textures)?;
            return Some(Leaving {
                ray: chosen.ray(),
                chosen,
                source: Some(light),
                multipliers: [area.emission.diffuse, area.emission.specular],
            });
        }
        if light < n_area + lights.mesh.len() as u32 {
            let mesh = &lights.mesh;
            let (chosen, interaction) = mesh.emit(
                light,
                self.target(light),
                u_direction,
                u_point,
                geometry,
                textures,
            )?;
            return Some(Leaving {
                ray: interaction.spawn_ray(chosen.dir, f32::INFINITY, VISIBILITY),
                chosen,
                source: Some(n_area + mesh.group_of(light)),
                multipliers: [1.0; 2],
            });
        }
        self.leave_infinity(light, u_direction, u_point)
    }

    fn leave_infinity(&self, light: u32, u_direction: Vec2, u_point: Vec2) -> Option<Leaving> {
        let lights = self.lights;
        let n_finite = lights.area.len() + lights.mesh.len();
        let (sample, multipliers) = match lights.infinite.get(light as usize - n_finite)? {
            InfiniteLight::Distant(l) => (l.sample(u_direction), [l.diffuse, l.specular]),
            InfiniteLight::Dome(l) => {
                let sample = l.sample_emission(u_direction, self.textures)?;
                (sample, [l.diffuse, l.specular])
            }
        };
        let dir = -sample.wi;
        let (p, per_area) = self.target(light).entry(&self.lit?, dir, u_point);
        let chosen = LightRay {
            p,
            dir,
            radiance: sample.radiance,
            cross_section: 1.0 / per_area,
            pdf_direction: sample.pdf,
            is_delta: sample.is_delta,
            clearance: 0.0,
        };
        Some(Leaving {
            ray: chosen.ray(),
            chosen,
            source: None,
            multipliers,
        })
    }
}

/// What rays from lights meet: what holds light back, and what scatters it.
const VISIBILITY: Visibility = Visibility(Visibility::SHADOW.0 | Visibility::INDIRECT.0);

impl LightRay {
    fn ray(&self) -> Ray {
        Ray {
            t_min: self.clearance,
            visibility: VISIBILITY,
            ..Ray::new(self.p, self.dir)
        }
    }
}

#[cfg(test)]
mod tests;
