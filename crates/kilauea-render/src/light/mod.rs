//! Light sources: sampling toward them, meeting them, and choosing among them.

mod aim;
mod area;
mod area_bvh;
mod area_emission;
mod choose;
mod connection;
mod distant;
mod distribution;
mod dome;
mod dome_picture;
mod emission;
mod emission_cone;
mod emission_density;
mod emit;
mod glint;
mod light_choice;
mod likeliest;
mod lit_box;
mod lit_sides;
mod mesh;
mod mesh_emission;
mod places;
mod source;
mod spherical_rect;
mod spherical_triangle;
mod spot_cone;
mod tree;
mod walk;

use kilauea_accel::Ray;
use kilauea_math::{Bounds3, Spectrum, Vec2, Vec3};
use kilauea_scene::{Camera, Light, LightShape, Scene};
use kilauea_texture::TextureStore;

use crate::camera::eye;
use crate::geometry::{Geometry, Interaction};
pub(crate) use aim::UsefulRay;
use area::AreaLight;
use area_bvh::AreaBvh;
use choose::PickedLight;
use distant::DistantLight;
use dome::DomeLight;
pub(crate) use emit::{EmittedPhoton, Emitter};
use glint::Brightness;
use mesh::MeshLights;
use tree::{LightBounds, LightTree, MAX_IMPORTANCE};
pub(crate) use walk::{ByCells, ByImportance, CellWalk, ImportanceWalk, LightChooser};

/// A direction toward a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    /// Unit direction from the lit point.
    pub wi: Vec3,
    /// To the light; infinite for domes and distant lights.
    pub distance: f32,
    /// Radiance that arrives from there if nothing is in between.
    pub radiance: Spectrum,
    /// Density per solid angle; the probability 1 for a delta light.
    pub pdf: f32,
    /// Whether no other strategy can find that direction.
    pub is_delta: bool,
}

/// A light sample with the light's multipliers, weighted for having been chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChosenLight {
    /// The sample; its density includes the choice of the light.
    pub sample: LightSample,
    /// Multiplies what diffuse lobes reflect.
    pub diffuse: f32,
    /// Multiplies what specular lobes reflect.
    pub specular: f32,
    /// Number of the light: finite ones, then those at infinity.
    pub light: u32,
}

/// Emission met by a ray, with what multiple importance sampling needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Emitted {
    /// Radiance along the ray.
    pub radiance: Spectrum,
    /// Density with which light sampling at the ray's origin would have chosen this direction.
    pub pdf: f32,
    /// Multiplies what diffuse lobes reflect.
    pub diffuse: f32,
    /// Multiplies what specular lobes reflect.
    pub specular: f32,
    /// Whether camera rays see it.
    pub visible_to_camera: bool,
    /// Number of the light; none of what no ray is aimed at.
    pub light: Option<u32>,
}

/// Where light is received: the point and the normal on the side that is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    /// Engine space.
    pub p: Vec3,
    /// Unit length.
    pub n: Vec3,
}

/// All lights of a scene.
///
/// Finite lights are numbered: area lights first, then the triangles of emissive meshes.
pub struct Lights {
    area: Vec<AreaLight>,
    area_bvh: AreaBvh,
    mesh: MeshLights,
    tree: LightTree,
    infinite: Vec<InfiniteLight>,
    brightness: Brightness,
    /// Of those at infinity together, where a finite light has one.
    even_weight: f32,
    /// Of area lights, then of those at infinity: their numbers in the scene.
    numbers_in_scene: Vec<u32>,
}

/// Lights that surround the scene.
#[derive(Clone, Debug)]
enum InfiniteLight {
    Distant(DistantLight),
    Dome(Box<DomeLight>),
}

impl Receiver {
    /// A point with a unit normal on either side, as light sees it that goes on to `wo`.
    #[inline]
    pub(crate) fn facing(p: Vec3, n: Vec3, wo: Vec3) -> Self {
        let n = if n.dot(wo) < 0.0 { -n } else { n };
        Self { p, n }
    }
}

impl Lights {
    /// Prepares all lights, as they are seen by `camera`.
    pub fn new(
        scene: &Scene,
        camera: &Camera,
        geometry: &Geometry,
        textures: &TextureStore,
    ) -> Self {
        let lit = || {
            let lights = (0..).zip(&scene.lights);
            lights.filter(|(_, light)| !light.radiance.is_black())
        };
        let (mut numbers_in_scene, area): (Vec<u32>, Vec<AreaLight>) = lit()
            .filter_map(|(idx, light)| Some((idx, AreaLight::new(light, scene.origin_world)?)))
            .unzip();
        let (around, infinite): (Vec<u32>, Vec<InfiniteLight>) = lit()
            .filter_map(|(idx, light)| Some((idx, InfiniteLight::new(light, textures)?)))
            .unzip();
        numbers_in_scene.extend(around);
        let p_camera = eye(&camera.world_from_camera, scene.origin_world);
        let mesh = MeshLights::new(geometry, textures, area.len() as u32, p_camera);
        let bounds: Vec<Bounds3> = area.iter().map(AreaLight::bounds).collect();
        let n_finite = area.len() + mesh.len();
        let tree_entries = area
            .iter()
            .map(|light| area_light_bounds(light, textures))
            .chain(mesh.light_bounds(geometry))
            .enumerate()
            .map(|(idx, b)| (idx as u32, b))
            .collect();
        Self {
            tree: LightTree::new(tree_entries, n_finite),
            area_bvh: AreaBvh::new(&bounds),
            area,
            mesh,
            even_weight: infinite.iter().map(InfiniteLight::even_weight).sum(),
            brightness: Brightness::of(&infinite),
            infinite,
            numbers_in_scene,
        }
    }

    /// Whether they are others where they are seen from elsewhere.
    pub(crate) fn depend_on_camera(&self) -> bool {
        self.mesh.has_hidden_sides()
    }

    /// Number of lights and emissive triangles.
    pub fn len(&self) -> usize {
        self.area.len() + self.mesh.len() + self.infinite.len()
    }

    /// Whether rays can meet lights that are not meshes.
    pub fn has_area_lights(&self) -> bool {
        !self.area.is_empty()
    }

    /// Prims that emit, but that no ray is aimed at because they move.
    pub fn unsampled_prims(&self) -> impl Iterator<Item = u32> {
        self.mesh.unsampled()
    }

    /// Whether rays can meet light that comes from infinity: parallel light has no direction that
    /// a ray could have by chance.
    pub fn rays_meet_infinite_lights(&self) -> bool {
        let is_met = |light: &InfiniteLight| match light {
            InfiniteLight::Distant(light) => !light.is_delta(),
            InfiniteLight::Dome(_) => true,
        };
        self.infinite.iter().any(is_met)
    }

    /// Bytes of the light tree, and of what directions toward domes are chosen by.
    pub fn n_bytes(&self) -> usize {
        let of_domes = self.infinite.iter().map(|light| match light {
            InfiniteLight::Dome(dome) => dome.n_bytes(),
            InfiniteLight::Distant(_) => 0,
        });
        self.tree.n_bytes() + self.mesh.n_bytes() + of_domes.sum::<usize>()
    }

    /// A direction toward a light that was chosen, drawn with `u`.
    #[inline]
    pub(crate) fn sample(
        &self,
        picked: PickedLight,
        receiver: Receiver,
        u: Vec2,
        geometry: &Geometry,
        textures: &TextureStore,
    ) -> Option<ChosenLight> {
        let PickedLight { light, probability } = picked;
        let n_finite = self.area.len() + self.mesh.len();
        let (mut sample, diffuse, specular) = if let Some(area) = self.area.get(light as usize) {
            let sample = area.sample(receiver.p, u, textures)?;
            (sample, area.emission.diffuse, area.emission.specular)
        } else if (light as usize) < n_finite {
            let sample = self.mesh.sample(light, receiver.p, u, geometry, textures)?;
            (sample, 1.0, 1.0)
        } else {
            match &self.infinite[light as usize - n_finite] {
                InfiniteLight::Distant(l) => (l.sample(u), l.diffuse, l.specular),
                InfiniteLight::Dome(l) => {
                    let sample = l.sample(receiver.n, u, textures)?;
                    (sample, l.diffuse, l.specular)
                }
            }
        };
        sample.pdf *= probability;
        (sample.pdf > 0.0 && !sample.radiance.is_black()).then_some(ChosenLight {
            sample,
            diffuse,
            specular,
            light,
        })
    }

    /// Visits every area light that the ray meets within its range, with the distance. Lights let
    /// rays through.
    #[inline]
    pub(crate) fn for_each_area_hit(
        &self,
        ray: &Ray,
        receiver: Option<Receiver>,
        chooser: impl LightChooser,
        textures: &TextureStore,
        mut visit: impl FnMut(f32, Emitted),
    ) {
        self.area_bvh.for_each(ray, |idx| {
            let light = &self.area[idx as usize];
            if let Some(hit) = light.intersect(ray) {
                let pdf = receiver.map_or(0.0, |r| {
                    self.probability(idx, r, chooser) * light.pdf(r.p, ray.dir, &hit)
                });
                let emitted = Emitted {
                    radiance: light.radiance(&hit, ray.dir, textures),
                    pdf,
                    diffuse: light.emission.diffuse,
                    specular: light.emission.specular,
                    visible_to_camera: light.visible_to_camera,
                    light: Some(idx),
                };
                visit(hit.t, emitted);
            }
        });
    }

    /// Visits the light that arrives from infinity against the unit direction `dir`.
    #[inline]
    pub(crate) fn for_each_infinite(
        &self,
        dir: Vec3,
        receiver: Option<Receiver>,
        chooser: impl LightChooser,
        textures: &TextureStore,
        mut visit: impl FnMut(Emitted),
    ) {
        for (idx, light) in self.infinite.iter().enumerate() {
            let normal = receiver.map(|r| r.n);
            let (radiance, pdf, diffuse, specular, visible_to_camera) = match light {
                InfiniteLight::Distant(l) => match l.radiance_and_pdf(dir) {
                    Some((radiance, pdf)) => {
                        (radiance, pdf, l.diffuse, l.specular, l.visible_to_camera)
                    }
                    None => continue,
                },
                InfiniteLight::Dome(l) => {
                    let (radiance, pdf) = l.radiance_and_pdf(normal, dir, textures);
                    (radiance, pdf, l.diffuse, l.specular, l.visible_to_camera)
                }
            };
            let light = self.infinite_number(idx);
            let probability = receiver.map_or(0.0, |r| self.probability(light, r, chooser));
            visit(Emitted {
                radiance,
                pdf: pdf * probability,
                diffuse,
                specular,
                visible_to_camera,
                light: Some(light),
            });
        }
    }

    /// Emission of a surface that was hit, if it emits toward `surface.wo`; `distance` is to the
    /// receiver.
    #[inline]
    pub(crate) fn emitted_by_surface(
        &self,
        interaction: &Interaction<'_>,
        distance: f32,
        receiver: Option<Receiver>,
        chooser: impl LightChooser,
    ) -> Option<Emitted> {
        if !interaction.shader.is_emissive() {
            return None;
        }
        let surface = &interaction.surface;
        let radiance = interaction.shader.emission(surface);
        if radiance.is_black() {
            return None;
        }
        let light = self.mesh.light_of(interaction.at);
        let pdf = receiver.zip(light).map_or(0.0, |(r, light)| {
            self.probability(light, r, chooser)
                * self
                    .mesh
                    .pdf(light, &surface.corners, r.p, surface.wo, distance)
        });
        Some(Emitted {
            radiance,
            pdf,
            diffuse: 1.0,
            specular: 1.0,
            visible_to_camera: true,
            light,
        })
    }

    /// Number of a light at infinity among all lights.
    fn infinite_number(&self, idx: usize) -> u32 {
        (self.area.len() + self.mesh.len() + idx) as u32
    }
}

impl InfiniteLight {
    /// None for other shapes, and for domes without light.
    fn new(light: &Light, textures: &TextureStore) -> Option<Self> {
        match light.shape {
            LightShape::Dome => DomeLight::new(light, textures)
                .filter(|dome| !dome.mean_radiance().is_black())
                .map(|dome| Self::Dome(Box::new(dome))),
            _ => DistantLight::new(light).map(Self::Distant),
        }
    }

    /// Its part of what is shared evenly, as nothing is known of occlusion.
    fn even_weight(&self) -> f32 {
        match self {
            Self::Distant(_) => 1.0,
            Self::Dome(l) => l.prominence(),
        }
    }

    /// Irradiance if nothing is occluded, without its sign; at most [`MAX_IMPORTANCE`].
    fn importance(&self, receiver: Receiver) -> f32 {
        let irradiance = match self {
            Self::Distant(l) => l.irradiance().luminance() * l.direction().dot(receiver.n).abs(),
            Self::Dome(l) => l.irradiance_to_find(),
        };
        irradiance.abs().min(MAX_IMPORTANCE)
    }
}

fn area_light_bounds(light: &AreaLight, textures: &TextureStore) -> LightBounds {
    let (axis, cos_normals) = light.normal_cone();
    let radiance = light.emission.mean_radiance(textures);
    LightBounds {
        bounds: light.bounds(),
        // A zero mean still leaves the light choosable: its texture may not be black everywhere.
        power: (radiance.luminance().abs() * light.area).clamp(f32::MIN_POSITIVE, f32::MAX),
        axis,
        cos_normals,
        cos_emission: 0.0,
        is_two_sided: false,
    }
}
