use kilauea_math::{Frame, Spectrum, Vec3};

use crate::lambert::Lambert;
use crate::layered::{Layered, Layers, View};
use crate::side::Side;

/// A BSDF at one point of a surface.
///
/// Surfaces are two-sided. The geometric normal alone decides whether a pair of directions
/// reflects or transmits, the shading normal gives the weights, and where the two disagree nothing
/// is scattered, so that no light leaks through. Transmitting lobes take the side of the geometric
/// normal for the outside.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    /// Shading frame, z on the side of `ng`.
    frame: Frame,
    /// Geometric normal, to the outside of the mesh.
    ng: Vec3,
    lobes: Lobes,
}

#[derive(Clone, Copy, Debug)]
enum Lobes {
    Lambert(Lambert),
    Layered(Layered),
}

/// A BSDF for a pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfEval {
    /// `f · |cos(wi, ns)|` of the diffuse lobes.
    pub diffuse: Spectrum,
    /// `f · |cos(wi, ns)|` of all other lobes; delta lobes count nothing.
    pub specular: Spectrum,
    /// Density per solid angle with which [`SeenBsdf::sample`] finds `wi`; without delta lobes.
    pub pdf: f32,
}

impl BsdfEval {
    /// Nothing is scattered and the direction is never sampled.
    pub const ZERO: Self = Self {
        diffuse: Spectrum::BLACK,
        specular: Spectrum::BLACK,
        pdf: 0.0,
    };

    /// Both families of lobes together.
    #[inline]
    pub fn total(&self) -> Spectrum {
        self.diffuse + self.specular
    }
}

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The direction.
    pub wi: Vec3,
    /// `f · |cos(wi, ns)| / pdf` of the diffuse lobes.
    pub diffuse: Spectrum,
    /// `f · |cos(wi, ns)| / pdf` of all other lobes.
    pub specular: Spectrum,
    /// Density per solid angle; for delta lobes the probability of the lobe.
    pub pdf: f32,
    /// Whether `wi` was the only direction possible.
    pub is_delta: bool,
    /// Whether `wi` is on the other side of the surface than `wo`.
    pub is_transmission: bool,
    /// Whether a diffuse lobe was drawn from.
    pub is_diffuse: bool,
    /// Roughness of the lobe drawn from (the square root of GGX's alpha): 1 for diffuse lobes, 0
    /// for delta lobes.
    pub roughness: f32,
}

impl BsdfSample {
    /// Whether it was drawn from a [`Mirror`].
    #[inline]
    pub fn is_mirrored(&self) -> bool {
        self.is_delta && !self.is_transmission
    }

    /// The throughput weight of both families of lobes together.
    #[inline]
    pub fn weight(&self) -> Spectrum {
        self.diffuse + self.specular
    }
}

/// All mirrors among the lobes: they reflect from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// The direction.
    pub wi: Vec3,
    /// Fraction of radiance that is reflected.
    pub reflectance: Spectrum,
    /// How likely [`SeenBsdf::sample`] draws from them.
    pub probability: f32,
}

impl Bsdf {
    /// An ideal diffuse reflector.
    ///
    /// `frame` is the shading frame, its z on the side of the geometric normal `ng`, which points
    /// to the outside of the mesh; `albedo` is in [0, 1].
    #[inline]
    pub fn lambert(frame: Frame, ng: Vec3, albedo: Spectrum) -> Self {
        Self {
            frame,
            ng,
            lobes: Lobes::Lambert(Lambert { albedo }),
        }
    }

    /// A layered surface: plastic, metal, glass, with or without a clear coat. `frame` and `ng`
    /// are as in [`Self::lambert`].
    #[inline]
    pub fn layered(frame: Frame, ng: Vec3, layers: &Layers) -> Self {
        Self {
            frame,
            ng,
            lobes: Lobes::Layered(Layered::new(layers)),
        }
    }

    /// A smooth boundary between dielectrics; `ior` is the index of refraction of the inside over
    /// that of the outside.
    #[inline]
    pub fn dielectric(frame: Frame, ng: Vec3, ior: f32) -> Self {
        Self::layered(
            frame,
            ng,
            &Layers {
                transmission: 1.0,
                ior,
                ..Layers::default()
            },
        )
    }

    /// The BSDF for one `wo`, with all that does not depend on `wi` computed once.
    // So that a shader which makes but one kind of lobes asks for no other.
    #[inline(always)]
    pub fn seen_from(&self, wo: Vec3) -> SeenBsdf {
        let side = Side::of(&self.frame, self.ng, wo);
        SeenBsdf {
            lobes: match self.lobes {
                Lobes::Lambert(lambert) => SeenLobes::Lambert(lambert, side),
                Lobes::Layered(layered) => SeenLobes::Layered(layered, layered.seen_from(side, wo)),
            },
            wo,
        }
    }

    /// See [`SeenBsdf::eval`].
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        self.seen_from(wo).eval(wi)
    }

    /// See [`SeenBsdf::sample`].
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        self.seen_from(wo).sample(u)
    }

    /// See [`SeenBsdf::has_smooth_lobes`].
    #[inline]
    pub fn has_smooth_lobes(&self) -> bool {
        match &self.lobes {
            Lobes::Lambert(lambert) => !lambert.albedo.is_black(),
            Lobes::Layered(layered) => layered.has_smooth_lobes(),
        }
    }

    /// The shading normal, on the side of the geometric one.
    #[inline]
    pub fn ns(&self) -> Vec3 {
        self.frame.z
    }

    /// See [`SeenBsdf::albedo`].
    #[inline]
    pub fn albedo(&self, wo: Vec3) -> Spectrum {
        self.seen_from(wo).albedo()
    }
}

/// A [`Bsdf`] as seen from one direction.
#[derive(Clone)]
pub struct SeenBsdf {
    lobes: SeenLobes,
    wo: Vec3,
}

#[derive(Clone)]
enum SeenLobes {
    Lambert(Lambert, Side),
    Layered(Layered, View),
}

impl SeenBsdf {
    /// What is scattered from `wi` to `wo`, and how likely [`Self::sample`] finds `wi`.
    #[inline]
    pub fn eval(&self, wi: Vec3) -> BsdfEval {
        match &self.lobes {
            SeenLobes::Lambert(lambert, side) => lambert.eval(side, wi),
            SeenLobes::Layered(layered, view) => layered.eval(view, self.wo, wi),
        }
    }

    /// What lobes narrower than a roughness scatter of [`Self::eval`].
    #[inline]
    pub fn eval_narrow(&self, wi: Vec3, end_roughness: f32) -> Spectrum {
        match &self.lobes {
            SeenLobes::Lambert(..) => Spectrum::BLACK,
            SeenLobes::Layered(layered, view) => {
                layered.eval_narrow(view, self.wo, wi, end_roughness * end_roughness)
            }
        }
    }

    /// Whether [`Self::eval_narrow`] can be anything but zero.
    #[inline]
    pub fn has_narrow_lobes(&self, end_roughness: f32) -> bool {
        match &self.lobes {
            SeenLobes::Lambert(..) => false,
            SeenLobes::Layered(layered, _) => {
                layered.has_narrow_lobes(end_roughness * end_roughness)
            }
        }
    }

    /// Whether [`Self::eval`] can be anything but zero; if not, asking lights is pointless.
    #[inline]
    pub fn has_smooth_lobes(&self) -> bool {
        match &self.lobes {
            SeenLobes::Lambert(lambert, _) => !lambert.albedo.is_black(),
            SeenLobes::Layered(layered, _) => layered.has_smooth_lobes(),
        }
    }

    /// Whether there are lobes of at least that roughness, which is 1 of diffuse ones.
    #[inline]
    pub fn has_rough_lobes(&self, min_roughness: f32) -> bool {
        match &self.lobes {
            SeenLobes::Lambert(lambert, _) => !lambert.albedo.is_black(),
            SeenLobes::Layered(layered, _) => {
                layered.has_rough_lobes(min_roughness * min_roughness)
            }
        }
    }

    /// Whether [`Self::sample`] has no lobe to choose, and ignores `u[0]`.
    #[inline]
    pub fn has_one_lobe(&self) -> bool {
        matches!(self.lobes, SeenLobes::Lambert(..))
    }

    /// How likely [`Self::sample`] draws from a lobe of at least that roughness.
    #[inline]
    pub fn probability_of_rough(&self, min_roughness: f32) -> f32 {
        match &self.lobes {
            SeenLobes::Lambert(..) => 1.0,
            SeenLobes::Layered(layered, view) => layered.probability_of_rough(view, min_roughness),
        }
    }

    /// How likely [`Self::sample`] draws from a diffuse lobe.
    #[inline]
    pub fn probability_of_diffuse(&self) -> f32 {
        match &self.lobes {
            SeenLobes::Lambert(..) => 1.0,
            SeenLobes::Layered(_, view) => Layered::probability_of_diffuse(view),
        }
    }

    /// What is reflected as by a mirror; none where nothing is.
    #[inline]
    pub fn mirror(&self) -> Option<Mirror> {
        match &self.lobes {
            SeenLobes::Lambert(..) => None,
            SeenLobes::Layered(layered, view) => layered.mirror(view, self.wo),
        }
    }

    /// Draws a direction; `u` is uniform in [0, 1)³: first the choice of the lobe, then the
    /// direction. None where the path ends.
    #[inline]
    pub fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        match &self.lobes {
            SeenLobes::Lambert(lambert, side) => lambert.sample(side, u),
            SeenLobes::Layered(layered, view) => layered.sample(view, self.wo, u),
        }
    }

    /// The fraction of light scattered, all lobes together.
    #[inline]
    pub fn albedo(&self) -> Spectrum {
        match &self.lobes {
            SeenLobes::Lambert(lambert, _) => lambert.albedo,
            SeenLobes::Layered(layered, view) => layered.albedo(view),
        }
    }

    /// The fraction of light scattered by diffuse lobes, if as much arrives from everywhere.
    #[inline]
    pub fn diffuse_albedo(&self) -> Spectrum {
        match &self.lobes {
            SeenLobes::Lambert(lambert, _) => lambert.albedo,
            SeenLobes::Layered(layered, view) => layered.diffuse_albedo(view),
        }
    }

    /// What diffuse lobes take of light that comes from where this is seen from: the cosine, and what
    /// an interface lets in. Seen from elsewhere, they scatter that times [`Self::diffuse_albedo`] / π.
    pub fn diffuse_reception(&self) -> Spectrum {
        match &self.lobes {
            SeenLobes::Lambert(_, side) => {
                Spectrum::splat(side.reflected_cos(self.wo).unwrap_or(0.0))
            }
            SeenLobes::Layered(layered, view) => layered.diffuse_reception(view),
        }
    }

    /// All lobes but the diffuse ones; none where there are no others.
    pub fn without_diffuse(&self) -> Option<Self> {
        match &self.lobes {
            SeenLobes::Lambert(..) => None,
            SeenLobes::Layered(layered, view) => {
                let (layered, view) = layered.without_diffuse(view)?;
                Some(Self {
                    lobes: SeenLobes::Layered(layered, view),
                    wo: self.wo,
                })
            }
        }
    }
}
