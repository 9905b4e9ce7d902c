//! The media that a path is in: nested dielectrics by priority (Schmidt & Budge, *Simple nested
//! dielectrics in ray traced images*, 2002).
//!
//! A path carries the materials of all closed meshes around it. Of these only the one of the
//! highest priority is there, so at a boundary the indices of refraction that count are those of
//! the highest before and after crossing it. Where that does not change, the boundary is *hidden*:
//! rays go on as if there were none.

use kilauea_accel::Hit;
use kilauea_math::{Spectrum, Vec3};
use kilauea_shading::Medium;
use shaders::Shader;

use super::camera_media::media_around;
use super::rays::RayTracer;
use crate::geometry::{Geometry, Interaction};

/// What a path knows of the media around it.
pub(crate) trait Media: Copy + Send + Sync {
    /// In air.
    const AIR: Self;

    /// In whatever is around a point.
    fn around(p: Vec3, rays: &RayTracer<'_, false>) -> Self;

    /// The priority below which boundaries are hidden to a ray that starts here.
    fn least_priority(&self, geometry: &Geometry) -> i8;

    /// Fraction of light that passes a distance.
    fn transmittance(&self, geometry: &Geometry, distance: f32) -> Spectrum;

    /// What a surface is to a path that arrives there; none where it bounds no medium.
    fn boundary(&self, geometry: &Geometry, at: &Interaction<'_>) -> Option<Boundary<Self>>;

    /// The hit, told from where the path scattered last and not from the last hidden boundary.
    fn since_departure(&self, hit: Hit) -> Hit;

    /// Goes on behind a hidden boundary, at a distance from where the path scattered last.
    fn pass(&mut self, boundary: &Boundary<Self>, distance: f32);

    /// Crosses a boundary by refraction.
    fn cross(&mut self, boundary: &Boundary<Self>);

    /// Scatters: distances count from here.
    fn depart(&mut self);

    /// Whether the path was in more media at once than can be told apart.
    fn has_overflowed(&self) -> bool;
}

/// A surface between media as a path sees it.
#[derive(Clone, Copy)]
pub(crate) struct Boundary<M> {
    /// Index of refraction outside of the mesh, for [`kilauea_shading::Surface::outside_ior`].
    pub(crate) outside_ior: f32,
    /// Whether rays pass as if nothing were there.
    pub(crate) is_hidden: bool,
    /// The media on the other side.
    beyond: M,
}

/// Air everywhere: what paths carry in scenes without media, which is nothing.
#[derive(Clone, Copy)]
pub(crate) struct Air;

impl Media for Air {
    const AIR: Self = Self;

    fn around(_: Vec3, _: &RayTracer<'_, false>) -> Self {
        Self
    }

    #[inline]
    fn least_priority(&self, _: &Geometry) -> i8 {
        i8::MIN
    }

    #[inline]
    fn transmittance(&self, _: &Geometry, _: f32) -> Spectrum {
        Spectrum::ONE
    }

    #[inline]
    fn boundary(&self, _: &Geometry, _: &Interaction<'_>) -> Option<Boundary<Self>> {
        None
    }

    #[inline]
    fn since_departure(&self, hit: Hit) -> Hit {
        hit
    }

    #[inline]
    fn pass(&mut self, _: &Boundary<Self>, _: f32) {}

    #[inline]
    fn cross(&mut self, _: &Boundary<Self>) {}

    #[inline]
    fn depart(&mut self) {}

    #[inline]
    fn has_overflowed(&self) -> bool {
        false
    }
}

/// Most media that a path can be in at once; those of the lowest priority are forgotten first.
const CAPACITY: usize = 8;
/// Most hidden boundaries between two vertices. Further ones are vertices that change nothing, so
/// that a path always ends.
const MAX_HIDDEN: u8 = 100;
/// An unused entry.
const NONE: u32 = u32::MAX;

/// The media around a path, by material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MediumStack {
    /// The highest priority first, among equals the one entered last; then [`NONE`].
    materials: [u32; CAPACITY],
    /// Distance from where the path scattered last to the last hidden boundary.
    travelled: f32,
    /// Hidden boundaries since the path scattered last.
    n_hidden: u8,
    has_overflowed: bool,
}

impl MediumStack {
    /// The medium that is there.
    #[inline]
    fn top(&self, geometry: &Geometry) -> Option<Medium> {
        interior(geometry, self.materials[0])
    }

    /// The stack after a boundary of `material` was crossed from the outside.
    pub(super) fn entered(mut self, geometry: &Geometry, material: u32) -> Self {
        let priority = |material| interior(geometry, material).map(|medium| medium.priority);
        let place = self
            .materials
            .iter()
            .position(|&other| priority(other) <= priority(material));
        self.has_overflowed |= self.materials[CAPACITY - 1] != NONE;
        if let Some(place) = place {
            self.materials.copy_within(place..CAPACITY - 1, place + 1);
            self.materials[place] = material;
        }
        self
    }

    /// The stack after a boundary of `material` was crossed from the inside.
    pub(super) fn left(mut self, material: u32) -> Self {
        if let Some(place) = self.materials.iter().position(|&other| other == material) {
            self.materials.copy_within(place + 1.., place);
            self.materials[CAPACITY - 1] = NONE;
        }
        self
    }
}

impl Media for MediumStack {
    const AIR: Self = Self {
        materials: [NONE; CAPACITY],
        travelled: 0.0,
        n_hidden: 0,
        has_overflowed: false,
    };

    fn around(p: Vec3, rays: &RayTracer<'_, false>) -> Self {
        media_around(p, rays)
    }

    #[inline]
    fn least_priority(&self, geometry: &Geometry) -> i8 {
        self.top(geometry).map_or(i8::MIN, |medium| medium.priority)
    }

    #[inline]
    fn transmittance(&self, geometry: &Geometry, distance: f32) -> Spectrum {
        self.top(geometry)
            .map_or(Spectrum::ONE, |medium| medium.transmittance(distance))
    }

    fn boundary(&self, geometry: &Geometry, at: &Interaction<'_>) -> Option<Boundary<Self>> {
        let inside = at.shader.interior()?;
        let material = geometry.material(at.at);
        let is_entering = at.surface.ng.dot(at.surface.wo) >= 0.0;
        let beyond = if is_entering {
            self.entered(geometry, material)
        } else {
            self.left(material)
        };
        let outside = if is_entering { *self } else { beyond };
        let around = outside.top(geometry);
        let is_lower = around.is_some_and(|around| around.priority > inside.priority);
        // From the inside: an equal that was entered later covers this one on both sides.
        let is_covered =
            !is_entering && self.materials[0] != material && self.materials.contains(&material);
        Some(Boundary {
            outside_ior: match around {
                Some(_) if is_lower || is_covered => inside.ior,
                Some(around) => around.ior,
                None => 1.0,
            },
            is_hidden: is_lower && self.n_hidden < MAX_HIDDEN,
            beyond,
        })
    }

    #[inline]
    fn since_departure(&self, hit: Hit) -> Hit {
        Hit {
            t: self.travelled + hit.t,
            ..hit
        }
    }

    fn pass(&mut self, boundary: &Boundary<Self>, distance: f32) {
        *self = Self {
            travelled: distance,
            n_hidden: self.n_hidden + 1,
            ..boundary.beyond
        };
    }

    #[inline]
    fn cross(&mut self, boundary: &Boundary<Self>) {
        *self = boundary.beyond;
    }

    #[inline]
    fn depart(&mut self) {
        self.travelled = 0.0;
        self.n_hidden = 0;
    }

    #[inline]
    fn has_overflowed(&self) -> bool {
        self.has_overflowed
    }
}

/// Whether boundaries of a shader's medium are not there to a ray in a medium of `least_priority`.
#[inline]
pub(super) fn is_hidden(shader: &Shader, least_priority: i8) -> bool {
    let interior = shader.interior();
    interior.is_some_and(|medium| medium.priority < least_priority)
}

#[inline]
fn interior(geometry: &Geometry, material: u32) -> Option<Medium> {
    geometry.shaders().get(material as usize)?.interior()
}
