//! Caustics by merging, beside hitting and connecting to lights.

use kilauea_bsdf::SeenBsdf;
use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{DensityRule, EyeSubpath, Merging, PhotonClass, PhotonMap, SurfaceQuery};
use kilauea_scene::Visibility;

use super::Merge;
use crate::geometry::Geometry;
use crate::integrator::guide::Knowledge;
use crate::integrator::walk::{Segment, Vertex};
use crate::light::{ChosenLight, Emitted, Emitter};
use crate::photon::{MIN_ROUGHNESS, adjoint_pdf, is_specular};

/// Merges at the first vertex where a path does not scatter as by a mirror, with photons that came
/// over specular surfaces alone: L S⁺ D S* E.
///
/// Each such path is weighed against the other ways to find it by the balance heuristic
/// (`kilauea_photon::Merging`), all others are left as they are.
#[derive(Clone, Copy)]
pub(crate) struct CausticMerge<'a> {
    /// Caustic photons.
    pub(crate) map: &'a PhotonMap,
    /// Of those that the photons were emitted by.
    pub(crate) emitter: &'a Emitter<'a>,
    pub(crate) geometry: &'a Geometry,
    pub(crate) merging: Merging,
    /// Engine space.
    pub(crate) radius: f32,
    /// Specular surfaces that photons have met at most.
    pub(crate) max_specular: u32,
    /// Scattering events after which paths still merge: all that photons bring there, longer paths
    /// could find as well.
    pub(crate) max_depth: u32,
    /// Whether some rays do not meet something.
    pub(crate) has_masks: bool,
}

/// What a path that merges keeps of its way.
#[derive(Clone, Copy)]
pub(crate) struct MergingEye {
    stage: Stage,
    /// Light of photons, scattered by diffuse lobes and by all others.
    gathered: Option<[Spectrum; 2]>,
}

#[derive(Clone, Copy)]
enum Stage {
    /// Has been scattered by specular surfaces alone: S*E.
    Specular,
    /// Has been scattered at one vertex where it could merge, then by specular surfaces alone:
    /// S*DS*E.
    BehindRough {
        subpath: EyeSubpath,
        n_specular: u32,
    },
    /// Finds light that no photon has that is looked for.
    Other,
}

impl CausticMerge<'_> {
    fn merges_at<M>(&self, vertex: &Vertex<'_, M>, bsdf: &SeenBsdf) -> bool {
        vertex.depth <= self.max_depth
            && bsdf.max_roughness() >= Some(MIN_ROUGHNESS)
            && !(self.has_masks && self.is_hidden_from_photons(vertex))
    }

    fn is_hidden_from_photons<M>(&self, vertex: &Vertex<'_, M>) -> bool {
        let met_by = self.geometry.met_by(vertex.interaction.at);
        met_by & Visibility::INDIRECT == Visibility::NONE
    }

    /// Light of the photons around a vertex, scattered by diffuse lobes and by all others.
    fn merged<M>(
        &self,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
        knowledge: &impl Knowledge,
    ) -> [Spectrum; 2] {
        let surface = &vertex.interaction.surface;
        let query = SurfaceQuery {
            p: surface.p,
            n: normal_toward(surface.ng, surface.wo),
        };
        let rule = DensityRule::default();
        let radius_sq = self.radius * self.radius;
        let [mut diffuse, mut specular] = [Spectrum::BLACK; 2];
        self.map
            .for_each_within(query.p, self.radius, |photon, d_sq| {
                let PhotonClass::Caustic { d_eye } = photon.class() else {
                    return;
                };
                let wi = photon.wi();
                // Photons arrive by the area of the true surface; the BSDF has the cosine to the
                // shading normal (Veach 1997, eq. 5.19).
                let cos_true = wi.dot(query.n);
                if cos_true <= 0.0 || !rule.accepts(&query, photon, d_sq) {
                    return;
                }
                let eval = bsdf.eval(wi);
                let pdf = knowledge.pdf(bsdf, wi, eval.pdf);
                let weight = self.merging.weight_of_photon(d_eye, pdf);
                let per_area = rule.kernel.weight(d_sq, radius_sq);
                let light = photon.power() * (weight * per_area / cos_true);
                diffuse += eval.diffuse * light;
                specular += eval.specular * light;
            });
        [diffuse, specular]
    }

    /// The part of a path behind its rough vertex that goes on from a specular one to `wi`, which it
    /// chose with the density `pdf`; `is_delta` if there was no other direction.
    fn extend<M>(
        subpath: EyeSubpath,
        vertex: &Vertex<'_, M>,
        wi: Vec3,
        pdf: f32,
        is_delta: bool,
    ) -> EyeSubpath {
        let surface = &vertex.interaction.surface;
        let reverse_pdf = if is_delta {
            pdf
        } else {
            let bsdf = vertex.interaction.shader.bsdf(surface);
            adjoint_pdf(&bsdf, surface.ng, wi, surface.wo)
        };
        subpath.arrived(surface.wo.dot(surface.ng).abs()).scattered(
            pdf,
            reverse_pdf,
            wi.dot(surface.ng).abs(),
        )
    }

    /// `p` and the unit vector `wi` toward the light are of the ray that meets it.
    fn d_light(&self, subpath: EyeSubpath, light: u32, p: Vec3, wi: Vec3) -> f32 {
        subpath.d_light(self.emitter.density(light, p, -wi), 1.0)
    }
}

impl Merge for CausticMerge<'_> {
    type Eye = MergingEye;

    fn start(&self) -> MergingEye {
        MergingEye {
            stage: Stage::Specular,
            gathered: None,
        }
    }

    fn gather<M>(
        &self,
        eye: &mut MergingEye,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
        knowledge: &impl Knowledge,
    ) -> bool {
        if !matches!(eye.stage, Stage::Specular) || !self.merges_at(vertex, bsdf) {
            return false;
        }
        let gathered = self
            .merged(vertex, bsdf, knowledge)
            .map(|light| light * vertex.passed);
        let is_any = gathered.iter().any(|light| !light.is_black());
        eye.gathered = is_any.then_some(gathered);
        is_any
    }

    #[inline]
    fn take(eye: &mut MergingEye) -> Option<[Spectrum; 2]> {
        eye.gathered.take()
    }

    fn depart<M>(
        &self,
        eye: &mut MergingEye,
        way: Segment<'_>,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
    ) {
        let (pdf, is_delta) = (way.departure.pdf, way.departure.is_delta);
        let wi = way.ray.dir;
        let is_specular = is_specular(is_delta, bsdf);
        eye.stage = match eye.stage {
            Stage::Specular if is_specular => Stage::Specular,
            Stage::Specular if self.merges_at(vertex, bsdf) => {
                let cos_out = wi.dot(vertex.interaction.surface.ng).abs();
                Stage::BehindRough {
                    subpath: EyeSubpath::left_rough(pdf, cos_out),
                    n_specular: 0,
                }
            }
            Stage::BehindRough {
                subpath,
                n_specular,
            } if is_specular && n_specular < self.max_specular => Stage::BehindRough {
                subpath: Self::extend(subpath, vertex, wi, pdf, is_delta),
                n_specular: n_specular + 1,
            },
            _ => Stage::Other,
        };
    }

    fn weight_of_hit(
        &self,
        eye: &MergingEye,
        way: Option<Segment<'_>>,
        emitted: &Emitted,
    ) -> Option<f32> {
        let Stage::BehindRough {
            subpath,
            n_specular: 1..,
        } = eye.stage
        else {
            return None;
        };
        let Segment { departure, ray } = way?;
        let d_light = self.d_light(subpath, emitted.light?, ray.origin, ray.dir);
        let connect_pdf = if departure.is_delta { 0.0 } else { emitted.pdf };
        let weight = self
            .merging
            .weight_of_hit(d_light, departure.pdf, connect_pdf);
        Some(weight)
    }

    fn weight_of_connection<M>(
        &self,
        eye: &MergingEye,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
        light: &ChosenLight,
        hit_pdf: f32,
    ) -> Option<f32> {
        let Stage::BehindRough {
            subpath,
            n_specular,
        } = eye.stage
        else {
            return None;
        };
        if n_specular >= self.max_specular || !is_specular(false, bsdf) {
            return None;
        }
        let sample = &light.sample;
        let subpath = Self::extend(subpath, vertex, sample.wi, sample.pdf, false);
        let d_light = self.d_light(
            subpath,
            light.light,
            vertex.interaction.surface.p,
            sample.wi,
        );
        let weight = self
            .merging
            .weight_of_connection(d_light, hit_pdf, sample.pdf);
        Some(weight)
    }
}

/// A unit normal of a surface on the side of `wo`.
pub(super) fn normal_toward(n: Vec3, wo: Vec3) -> Vec3 {
    if n.dot(wo) < 0.0 { -n } else { n }
}
