//! What travels from surface to surface, from the camera or from a light, and the media on its way.

use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_texture::TextureStore;

use crate::geometry::{Carried, Geometry, Interaction, View};
use crate::integrator::{Boundary, Media};

/// Something on its way.
#[derive(Clone, Copy)]
pub(super) struct Traveller<M> {
    /// From where it left a surface last; what lies before `t_min` is passed already.
    from_departure: Ray,
    /// What is to be traced: the part behind all that is passed.
    pub(super) ray: Ray,
    /// What it carries, in watts or as a share.
    pub(super) carried: Spectrum,
    pub(super) media: M,
}

/// Where a traveller has arrived.
pub(super) struct Vertex<'a, M> {
    pub(super) interaction: Interaction<'a>,
    /// None on surfaces that bound no medium.
    boundary: Option<Boundary<M>>,
    /// From where it left a surface last.
    pub(super) distance: f32,
}

/// All surfaces, as travellers find them.
#[derive(Clone, Copy)]
pub(super) struct Surfaces<'a> {
    pub(super) geometry: &'a Geometry,
    pub(super) textures: &'a TextureStore,
}

impl<M: Media> Traveller<M> {
    pub(super) fn new(ray: Ray, carried: Spectrum, media: M) -> Self {
        Self {
            from_departure: ray,
            ray,
            carried,
            media,
        }
    }

    /// Goes on from a surface in the unit direction `dir`.
    pub(super) fn leave(&mut self, vertex: &Vertex<'_, M>, dir: Vec3, is_transmission: bool) {
        if is_transmission && let Some(boundary) = &vertex.boundary {
            self.media.cross(boundary);
        }
        self.depart(vertex, dir, Visibility::INDIRECT);
    }

    /// Goes on behind a surface as if it were not there.
    pub(super) fn pass(&mut self, vertex: &Vertex<'_, M>) {
        let Ray {
            dir, visibility, ..
        } = self.ray;
        self.depart(vertex, dir, visibility);
    }

    fn depart(&mut self, vertex: &Vertex<'_, M>, dir: Vec3, visibility: Visibility) {
        self.media.depart();
        self.ray = vertex.interaction.spawn_ray(dir, f32::INFINITY, visibility);
        self.from_departure = self.ray;
    }
}

impl<'a> Surfaces<'a> {
    /// Arrives at what the traveller's ray hit. What media absorb on the way is taken from what it
    /// carries. None where the surface is a boundary that its medium hides: the ray goes on behind.
    pub(super) fn meet<'s, M: Media>(
        &self,
        traveller: &mut Traveller<M>,
        (hit, carried): (Hit, Option<&'s Carried>),
        footprint: f32,
    ) -> Option<Vertex<'s, M>>
    where
        'a: 's,
    {
        let hit = traveller.media.since_departure(hit);
        let ray = &mut traveller.from_departure;
        let mut interaction = self.interaction((&hit, carried), ray, footprint);
        let boundary = traveller.media.boundary(self.geometry, &interaction);
        if let Some(boundary) = &boundary {
            if boundary.is_hidden {
                traveller.media.pass(boundary, hit.t);
                ray.t_min = hit.t;
                traveller.ray = interaction.spawn_ray(ray.dir, f32::INFINITY, ray.visibility);
                return None;
            }
            interaction.surface.outside_ior = boundary.outside_ior;
        }
        traveller.carried *= traveller.media.transmittance(self.geometry, hit.t);
        Some(Vertex {
            interaction,
            boundary,
            distance: hit.t,
        })
    }

    fn interaction<'s>(
        &self,
        (hit, carried): (&Hit, Option<&'s Carried>),
        ray: &Ray,
        footprint: f32,
    ) -> Interaction<'s>
    where
        'a: 's,
    {
        let view = View {
            uv: Vec2::new(hit.u, hit.v),
            p_ray: ray.at(hit.t),
            wo: -ray.dir,
            time: ray.time,
            footprint,
        };
        let (geometry, at) = (self.geometry, self.geometry.locate(hit));
        match carried {
            None => geometry.interaction(at, &view, self.textures),
            Some(carried) => geometry.interaction_of_carried(at, carried, &view, self.textures),
        }
    }
}

impl<M> Vertex<'_, M> {
    /// Whether there are media on either side.
    pub(super) fn bounds_medium(&self) -> bool {
        self.boundary.is_some()
    }

    /// The geometric normal on the side of arrival.
    pub(super) fn n(&self) -> Vec3 {
        let surface = &self.interaction.surface;
        if surface.wo.dot(surface.ng) < 0.0 {
            -surface.ng
        } else {
            surface.ng
        }
    }
}
