use kilauea_math::{INV_PI, Spectrum, Vec2, Vec3, warp};

use crate::energy::{mean_albedo, split_sum};
use crate::fresnel::{self, Dielectric, dielectric, f0_from_ior, schlick, schlick_weight};
use crate::ggx::{Ggx, Half, MIN_ALPHA};
use crate::side::Side;
use crate::{BsdfEval, BsdfSample, Mirror};

/// What a layered surface is made of: a clear coat over a specular interface over a diffuse base,
/// or over clear glass, or over a mix of the two.
///
/// All reflectances and fractions are in [0, 1]; what is outside is clamped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    /// Albedo of the diffuse base under the interface, without the share of the glass.
    pub diffuse: Spectrum,
    /// Reflectance of the interface at normal incidence.
    pub f0: Spectrum,
    /// Reflectance of the interface at grazing incidence; at least `f0`.
    pub f90: Spectrum,
    /// Roughness of the interface; its GGX alpha is the square.
    pub roughness: f32,
    /// Fraction covered by the clear coat.
    pub coat: f32,
    /// Roughness of the clear coat.
    pub coat_roughness: f32,
    /// Fraction of the interface that has clear glass under it: Fresnel's equations with `ior`
    /// instead of `f0` and `f90`, refraction without roughness.
    pub transmission: f32,
    /// Fraction of the refracted light that passes.
    pub transmission_tint: Spectrum,
    /// Index of refraction, of the inside over the outside; of the clear coat too.
    pub ior: f32,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            diffuse: Spectrum::BLACK,
            f0: Spectrum::BLACK,
            f90: Spectrum::BLACK,
            roughness: 0.0,
            coat: 0.0,
            coat_roughness: 0.0,
            transmission: 0.0,
            transmission_tint: Spectrum::ONE,
            ior: 1.5,
        }
    }
}

/// [`Layers`], prepared.
///
/// - The interface: GGX, Schlick's Fresnel, energy of further bounces between facets returned
///   (Turquin 2019). Under glass the reflectance is that of the smooth boundary as seen from `wo`,
///   so that it and the refracted part add up to one.
/// - The diffuse base gets what the interface lets in and lets out again (Kelemen & Szirmay-Kalos
///   2001): `ρ/π (1 − E(µo)) (1 − E(µi)) / (1 − E_avg)`, with E the interface's albedo.
/// - The coat takes its albedo from all that lies under it.
///
/// Compensation, glass reflection and coat depend on `wo` alone, which makes them exact in energy
/// and not reciprocal; a surface without those is reciprocal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layered {
    diffuse: Spectrum,
    /// 1 / (1 − E_avg).
    diffuse_scale: Spectrum,
    f0: Spectrum,
    f90: Spectrum,
    alpha: f32,
    coat: f32,
    coat_alpha: f32,
    coat_f0: f32,
    transmission: f32,
    transmission_tint: Spectrum,
    ior: f32,
}

/// Everything that depends on `wo` and not on `wi`.
#[derive(Clone, Copy)]
pub(crate) struct View {
    side: Side,
    cos_o: f32,
    /// 1 − E(µo) of the interface.
    below_interface: Spectrum,
    /// Factor of the part with Schlick's Fresnel.
    schlick_scale: Spectrum,
    /// Reflectance of the part with glass.
    glass_scale: f32,
    /// What the coat lets through.
    below_coat: f32,
    boundary: Dielectric,
    /// Index of refraction of the far side over the near side.
    eta: f32,
    probability: Probabilities,
}

/// Of drawing from each lobe; they add up to one.
#[derive(Clone, Copy)]
struct Probabilities {
    coat: f32,
    interface: f32,
    diffuse: f32,
    glass: f32,
}

impl Layered {
    pub(crate) fn new(layers: &Layers) -> Self {
        let alpha = |roughness: f32| {
            let alpha = roughness.clamp(0.0, 1.0).powi(2);
            if alpha < MIN_ALPHA { 0.0 } else { alpha }
        };
        let diffuse = layers.diffuse.clamp(0.0, 1.0);
        let f0 = layers.f0.clamp(0.0, 1.0);
        let f90 = layers.f90.clamp(0.0, 1.0);
        let interface_alpha = alpha(layers.roughness);
        let diffuse_scale = if diffuse.is_black() {
            Spectrum::BLACK
        } else {
            let below = Spectrum::ONE - mean_albedo(interface_alpha, f0, f90);
            Spectrum::ONE / below.max(1.0e-4)
        };
        let ior = layers.ior.clamp(1.0e-3, 1.0e3);
        Self {
            diffuse,
            diffuse_scale,
            f0,
            f90,
            alpha: interface_alpha,
            coat: layers.coat.clamp(0.0, 1.0),
            coat_alpha: alpha(layers.coat_roughness),
            coat_f0: f0_from_ior(ior),
            transmission: layers.transmission.clamp(0.0, 1.0),
            transmission_tint: layers.transmission_tint.clamp(0.0, 1.0),
            ior,
        }
    }

    pub(crate) fn sample(&self, view: &View, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let p = &view.probability;
        let uv = Vec2::new(u[1], u[2]);
        let mut pick = u[0];

        if pick < p.diffuse {
            let wi = view.side.frame.from_local(warp::cosine_hemisphere(uv));
            let sample = self.smooth_sample(view, wo, wi, 1.0)?;
            return Some(BsdfSample {
                is_diffuse: true,
                ..sample
            });
        }
        pick -= p.diffuse;
        if pick < p.interface {
            if self.alpha == 0.0 {
                return view.reflection(wo, self.mirrored_by_interface(view), p.interface);
            }
            let wi = view.draw_reflection(self.alpha, wo, uv);
            return self.smooth_sample(view, wo, wi, self.alpha.sqrt());
        }
        pick -= p.interface;
        if pick < p.coat {
            if self.coat_alpha == 0.0 {
                return view.reflection(wo, self.mirrored_by_coat(view), p.coat);
            }
            let wi = view.draw_reflection(self.coat_alpha, wo, uv);
            return self.smooth_sample(view, wo, wi, self.coat_alpha.sqrt());
        }
        (p.glass > 0.0).then(|| self.refraction(view, wo)).flatten()
    }

    /// All lobes that are mirrors.
    #[inline]
    pub(crate) fn mirror(&self, view: &View, wo: Vec3) -> Option<Mirror> {
        let p = &view.probability;
        let of_interface = self.alpha == 0.0 && p.interface > 0.0;
        let of_coat = self.coat_alpha == 0.0 && p.coat > 0.0;
        if !(of_interface || of_coat) {
            return None;
        }
        let mut mirror = Mirror {
            wi: view.mirror_direction(wo)?,
            reflectance: Spectrum::BLACK,
            probability: 0.0,
        };
        if of_interface {
            mirror.reflectance += self.mirrored_by_interface(view);
            mirror.probability += p.interface;
        }
        if of_coat {
            mirror.reflectance += self.mirrored_by_coat(view);
            mirror.probability += p.coat;
        }
        Some(mirror)
    }

    fn mirrored_by_interface(&self, view: &View) -> Spectrum {
        self.interface_reflectance(view, view.cos_o) * view.below_coat
    }

    fn mirrored_by_coat(&self, view: &View) -> Spectrum {
        Spectrum::splat(self.coat_reflectance(view.cos_o))
    }

    /// Whether any lobe but mirrors and refraction is there.
    pub(crate) fn has_smooth_lobes(&self) -> bool {
        !self.diffuse.is_black() || self.has_smooth_interface() || self.has_smooth_coat()
    }

    /// Whether there are lobes of at least that alpha.
    pub(crate) fn has_rough_lobes(&self, min_alpha: f32) -> bool {
        !self.diffuse.is_black()
            || (self.has_smooth_interface() && self.alpha >= min_alpha)
            || (self.has_smooth_coat() && self.coat_alpha >= min_alpha)
    }

    /// Whether lobes below an alpha are there that are no mirrors.
    pub(crate) fn has_narrow_lobes(&self, end_alpha: f32) -> bool {
        (self.has_smooth_interface() && self.alpha < end_alpha)
            || (self.has_smooth_coat() && self.coat_alpha < end_alpha)
    }

    /// Whether the interface or the glass under it reflects other than as a mirror.
    fn has_smooth_interface(&self) -> bool {
        let reflects = !(self.f0 + self.f90).is_black() || self.transmission > 0.0;
        self.alpha > 0.0 && reflects
    }

    fn has_smooth_coat(&self) -> bool {
        self.coat_alpha > 0.0 && self.coat > 0.0
    }

    /// Probability of all lobes of at least that roughness.
    pub(crate) fn probability_of_rough(&self, view: &View, min_roughness: f32) -> f32 {
        let p = &view.probability;
        let min_alpha = min_roughness * min_roughness;
        let of = |alpha: f32, probability: f32| {
            if alpha > 0.0 && alpha >= min_alpha {
                probability
            } else {
                0.0
            }
        };
        p.diffuse + of(self.alpha, p.interface) + of(self.coat_alpha, p.coat)
    }

    /// Fraction of light scattered.
    pub(crate) fn albedo(&self, view: &View) -> Spectrum {
        let opaque = (Spectrum::ONE - view.below_interface) * (1.0 - self.transmission);
        let base = opaque + self.diffuse * view.below_interface;
        let reflected = view.boundary.reflectance;
        let glass = self.transmission_tint.lerp(Spectrum::ONE, reflected) * self.transmission;
        Spectrum::splat(1.0 - view.below_coat) + (base + glass) * view.below_coat
    }

    /// Fraction of even light that the diffuse base scatters: E is coupled so that its mean over `wi`
    /// cancels.
    pub(crate) fn diffuse_albedo(&self, view: &View) -> Spectrum {
        self.diffuse * view.below_interface * view.below_coat
    }

    /// What the diffuse base takes of light from the viewer's direction.
    pub(crate) fn diffuse_reception(&self, view: &View) -> Spectrum {
        view.below_interface * self.diffuse_scale * view.cos_o
    }

    /// Probability of the diffuse base.
    pub(crate) fn probability_of_diffuse(view: &View) -> f32 {
        view.probability.diffuse
    }

    /// All but the diffuse base; none where that is all.
    pub(crate) fn without_diffuse(&self, view: &View) -> Option<(Self, View)> {
        let Probabilities {
            coat,
            interface,
            glass,
            ..
        } = view.probability;
        let others = coat + interface + glass;
        (others > 0.0).then(|| {
            let layered = Self {
                diffuse: Spectrum::BLACK,
                ..*self
            };
            let probability = Probabilities {
                coat: coat / others,
                interface: interface / others,
                diffuse: 0.0,
                glass: glass / others,
            };
            let view = View {
                probability,
                ..*view
            };
            (layered, view)
        })
    }

    #[inline]
    pub(crate) fn seen_from(&self, side: Side, wo: Vec3) -> View {
        let side = side.visible_from(wo);
        let cos_o = side.frame.z.dot(wo).min(1.0);
        let eta = if side.is_outside {
            self.ior
        } else {
            1.0 / self.ior
        };

        let interface = split_sum(self.alpha, cos_o);
        let compensation = interface.compensation(self.f0);
        let albedo = (self.f0 * interface.base + self.f90 * interface.edge) * compensation;
        let below_interface = (Spectrum::ONE - albedo).max(0.0);

        let boundary = if self.transmission > 0.0 {
            dielectric(cos_o, eta)
        } else {
            Dielectric {
                reflectance: 0.0,
                cos_t: 0.0,
            }
        };
        let coat_albedo = if self.coat > 0.0 {
            let coat = split_sum(self.coat_alpha, cos_o);
            self.coat * (self.coat_f0 * coat.base + coat.edge)
        } else {
            0.0
        };
        let below_coat = 1.0 - coat_albedo;

        let opaque = 1.0 - self.transmission;
        let reflected_by_glass = self.transmission * boundary.reflectance;
        let coat = coat_albedo;
        let interface_albedo = below_coat * (opaque * albedo.mean() + reflected_by_glass);
        let diffuse = below_coat * (self.diffuse * below_interface).mean();
        let refracted = self.transmission - reflected_by_glass;
        let glass = below_coat * refracted * self.transmission_tint.mean();
        let total = coat + interface_albedo + diffuse + glass;
        let normalization = if total > 0.0 { 1.0 / total } else { 0.0 };
        View {
            side,
            cos_o,
            below_interface,
            schlick_scale: compensation * opaque,
            glass_scale: reflected_by_glass / interface.white(),
            below_coat,
            boundary,
            eta,
            probability: Probabilities {
                coat: coat * normalization,
                interface: interface_albedo * normalization,
                diffuse: diffuse * normalization,
                glass: glass * normalization,
            },
        }
    }

    /// Reflectance of the interface's facets, energy compensation included.
    #[inline]
    fn interface_reflectance(&self, view: &View, cos_d: f32) -> Spectrum {
        schlick(self.f0, self.f90, cos_d) * view.schlick_scale + Spectrum::splat(view.glass_scale)
    }

    #[inline]
    fn coat_reflectance(&self, cos_d: f32) -> f32 {
        self.coat * (self.coat_f0 + (1.0 - self.coat_f0) * schlick_weight(cos_d))
    }

    #[inline]
    pub(crate) fn eval(&self, view: &View, wo: Vec3, wi: Vec3) -> BsdfEval {
        let mut eval = BsdfEval::ZERO;
        let Some(cos_i) = view.side.reflected_cos(wi) else {
            return eval;
        };
        let cos_i = cos_i.min(1.0);
        let p = &view.probability;
        if p.diffuse > 0.0 {
            let albedo_i = split_sum(self.alpha, cos_i).albedo(self.f0, self.f90);
            let below_i = (Spectrum::ONE - albedo_i).max(0.0);
            let coupling = view.below_interface * below_i * self.diffuse_scale;
            let cosine_pdf = cos_i * INV_PI;
            eval.diffuse = self.diffuse * coupling * (view.below_coat * cosine_pdf);
            eval.pdf = p.diffuse * cosine_pdf;
        }
        self.add_reflection(&mut eval, view, (wo, wi), cos_i, f32::INFINITY);
        eval
    }

    /// What lobes below an alpha, that are no mirrors, scatter of [`Self::eval`].
    pub(crate) fn eval_narrow(&self, view: &View, wo: Vec3, wi: Vec3, end_alpha: f32) -> Spectrum {
        let mut eval = BsdfEval::ZERO;
        if let Some(cos_i) = view.side.reflected_cos(wi) {
            self.add_reflection(&mut eval, view, (wo, wi), cos_i.min(1.0), end_alpha);
        }
        eval.specular
    }

    /// Adds what interface and coat reflect, as far as their alpha is below `end_alpha`.
    #[inline(always)]
    fn add_reflection(
        &self,
        eval: &mut BsdfEval,
        view: &View,
        (wo, wi): (Vec3, Vec3),
        cos_i: f32,
        end_alpha: f32,
    ) {
        let p = &view.probability;
        let is_smooth = |alpha: f32| alpha > 0.0 && alpha < end_alpha;
        let smooth_interface = is_smooth(self.alpha) && p.interface > 0.0;
        let smooth_coat = is_smooth(self.coat_alpha) && p.coat > 0.0;
        if !(smooth_interface || smooth_coat) {
            return;
        }
        let Some(half) = Half::between(view.side.frame.z, wo, wi) else {
            return;
        };
        if smooth_interface {
            let facets = Ggx::new(self.alpha, view.cos_o).eval(&half, cos_i);
            let reflectance = self.interface_reflectance(view, half.cos_d);
            eval.specular += reflectance * (view.below_coat * facets.f_cos);
            eval.pdf += p.interface * facets.pdf;
        }
        if smooth_coat {
            let facets = Ggx::new(self.coat_alpha, view.cos_o).eval(&half, cos_i);
            let reflectance = self.coat_reflectance(half.cos_d);
            eval.specular += Spectrum::splat(reflectance * facets.f_cos);
            eval.pdf += p.coat * facets.pdf;
        }
    }

    /// The sample for a direction drawn from a smooth lobe, weighted by all of them.
    #[inline]
    fn smooth_sample(&self, view: &View, wo: Vec3, wi: Vec3, roughness: f32) -> Option<BsdfSample> {
        let eval = self.eval(view, wo, wi);
        (eval.pdf > 0.0).then(|| BsdfSample {
            wi,
            diffuse: eval.diffuse / eval.pdf,
            specular: eval.specular / eval.pdf,
            pdf: eval.pdf,
            is_delta: false,
            is_transmission: false,
            is_diffuse: false,
            roughness,
        })
    }

    #[inline]
    fn refraction(&self, view: &View, wo: Vec3) -> Option<BsdfSample> {
        let (eta, n) = (view.eta, view.side.frame.z);
        let wi = fresnel::refract(wo, n, view.cos_o, eta, view.boundary.cos_t);
        let transmitted = self.transmission * (1.0 - view.boundary.reflectance) * view.below_coat;
        // Basic radiance, L/η², crosses the boundary unchanged (Nicodemus 1963).
        let weight = transmitted / view.probability.glass;
        (view.side.ng.dot(wi) < 0.0).then(|| BsdfSample {
            wi,
            diffuse: Spectrum::BLACK,
            specular: self.transmission_tint * weight,
            pdf: view.probability.glass,
            is_delta: true,
            is_transmission: true,
            is_diffuse: false,
            roughness: 0.0,
        })
    }
}

impl View {
    /// Draws from a rough reflective lobe.
    #[inline]
    fn draw_reflection(&self, alpha: f32, wo: Vec3, u: Vec2) -> Vec3 {
        let frame = &self.side.frame;
        let wi = Ggx::new(alpha, self.cos_o).sample(frame.to_local(wo), u);
        frame.from_local(wi)
    }

    /// None where the true surface hides it.
    #[inline]
    fn mirror_direction(&self, wo: Vec3) -> Option<Vec3> {
        let wi = fresnel::reflect(wo, self.side.frame.z);
        self.side.reflected_cos(wi).map(|_| wi)
    }

    #[inline]
    fn reflection(&self, wo: Vec3, reflectance: Spectrum, probability: f32) -> Option<BsdfSample> {
        self.mirror_direction(wo).map(|wi| BsdfSample {
            wi,
            diffuse: Spectrum::BLACK,
            specular: reflectance / probability,
            pdf: probability,
            is_delta: true,
            is_transmission: false,
            is_diffuse: false,
            roughness: 0.0,
        })
    }
}
