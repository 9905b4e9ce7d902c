use kilauea_accel::{Ray, Visibility};
use kilauea_bsdf::{Bsdf, SeenBsdf};
use kilauea_gather::{Arrival, GatherRecord};
use kilauea_math::hash::unit_f32;
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_photon::{LightSubpath, Photon, PhotonClass};
use kilauea_spot::{Context, Program};

use super::history::History;
use super::meeting::Meeting;
use super::scatter::{ScatteredLight, sample_adjoint};
use super::surfaces::{Surfaces, Traveller, Vertex};
use super::trace::{Kept, SplatView};
use super::{DrawnLobes, LOBES_KEY, MIN_ROUGHNESS, PhotonCounts, PhotonRequest, is_specular};
use crate::caustics::Splat;
use crate::follow::Follow;
use crate::integrator::{
    Aimed, Answer, Blame, LightPdfs, MIN_GUIDED_ROUGHNESS, MIN_PEAK, Media, Question, RayTracer,
    SeenVertex, SplatShares,
};
use crate::light::{EmittedPhoton, Emitter, Receiver, UsefulRay};
use crate::needs::SceneNeeds;
use crate::prepared::PreparedScene;
use crate::sampler::{PixelSequence, Purpose, Sampler, SamplerTables};

/// Follows photons from surface to surface. `CUTOUTS` and `M` as in the path integrator.
pub(super) struct PhotonTracer<'a, const CUTOUTS: bool, M> {
    emitter: &'a Emitter<'a>,
    surfaces: Surfaces<'a>,
    blame: &'a Blame,
    needs: SceneNeeds,
    max_depth: u32,
    kept: Kept<'a>,
    /// One over the number of paths.
    share: f32,
    /// Width of what a photon stands for: textures need not be sharper.
    footprint: f32,
    sequence: PixelSequence<'a>,
    /// The media that each source of light is in.
    media_of_source: Vec<M>,
}

/// What some paths left.
#[derive(Default)]
pub(super) struct LeftPhotons {
    pub(super) photons: Vec<Photon>,
    /// Greatest channel of a valid photon's power, also of those that are kept elsewhere.
    pub(super) brightest: f32,
    /// How the light left of the caustic ones where all are kept, or of each that is to scout.
    pub(super) useful_rays: Vec<UsefulRay>,
    /// What paths are aimed by, where that is all that is kept.
    pub(super) arrivals: Vec<GatherRecord>,
    /// What the camera sees of photons, where that is all that is kept.
    pub(super) splats: Vec<Splat>,
    /// Luminance of the power that lights sent out.
    pub(super) sent_out: f64,
    pub(super) counts: PhotonCounts,
}

/// Light on its way.
struct LightPath<M> {
    emitted: EmittedPhoton,
    /// Carries watts, divided by the number of paths.
    traveller: Traveller<M>,
    history: History,
    /// Surfaces met before.
    depth: u32,
    /// The first of them, once there is any.
    p_met: Vec3,
    /// Where the camera is to see photons: the ratio of densities at the first surface, which scattered
    /// light in a peak.
    at_last: Option<f32>,
}

/// What becomes of a path where it arrives.
struct Arrived {
    goes_on: bool,
    seen: Option<SeenPhoton>,
}

/// A photon that the camera sees, unless something is between them.
struct SeenPhoton {
    /// Whether something is.
    question: Question,
    splat: Splat,
    /// Whether to tell how its light left.
    is_scout: bool,
}

/// Rays to the camera end this much before its near plane.
const VIEW_T_MAX: f32 = 1.0 - 1e-4;

impl<const CUTOUTS: bool, M: Media> Follow for PhotonTracer<'_, CUTOUTS, M> {
    type Left = LeftPhotons;

    async fn follow<P, C>(&self, number: u32, left: &mut LeftPhotons, cx: &C)
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        left.counts.emitted += 1;
        let sampler = self.sequence.sampler(number);
        let Some(mut path) = self.emit(&sampler) else {
            return;
        };
        left.sent_out += f64::from(path.traveller.carried.luminance());
        while path.depth < self.max_depth {
            left.counts.rays += 1;
            let ray = &path.traveller.ray;
            let question = Question::closest::<CUTOUTS>(ray, &sampler, path.depth);
            let (hit, carried) = cx.ask(question).await.hit();
            let Some(hit) = hit else {
                left.counts.invalid_rays += u64::from(!path.traveller.ray.is_valid());
                break;
            };
            let footprint = self.footprint_at(path.traveller.ray.at(hit.t));
            let hit = (hit, carried.as_deref());
            let vertex = self.surfaces.meet(&mut path.traveller, hit, footprint);
            let Some(vertex) = vertex else { continue };
            match self.meeting(&path, &vertex) {
                Meeting::Arrives => {}
                Meeting::Blocked => break,
                Meeting::Divides => {
                    if path.goes_on_behind(&vertex, &sampler) {
                        continue;
                    }
                }
            }
            let arrived = self.arrive(&mut path, &vertex, number, left, &sampler);
            if let Some(seen) = arrived.seen {
                left.counts.rays += 1;
                if !cx.ask(seen.question).await.is_occluded() {
                    left.see(&seen, &path);
                }
            }
            if !arrived.goes_on {
                break;
            }
        }
        let media = &path.traveller.media;
        left.counts.in_too_many_media += u64::from(media.has_overflowed());
    }
}

impl<'a, const CUTOUTS: bool, M: Media> PhotonTracer<'a, CUTOUTS, M> {
    pub(super) fn new(
        emitter: &'a Emitter<'a>,
        prepared: &'a PreparedScene,
        blame: &'a Blame,
        request: &PhotonRequest,
        kept: Kept<'a>,
        tables: &'a SamplerTables,
    ) -> Self {
        let PreparedScene {
            geometry, textures, ..
        } = prepared;
        let rays = RayTracer::<false>::of(prepared, blame);
        let media = |p| M::around(p, &rays);
        Self {
            emitter,
            surfaces: Surfaces { geometry, textures },
            blame,
            needs: prepared.needs,
            max_depth: request.max_depth,
            kept,
            share: 1.0 / request.n_emitted as f32,
            footprint: (emitter.mean_cross_section() / request.n_emitted as f32).sqrt(),
            sequence: tables.pixel([0, 0]),
            media_of_source: emitter.sources().map(media).collect(),
        }
    }

    /// Width of what is looked at where a photon is.
    fn footprint_at(&self, p: Vec3) -> f32 {
        match self.kept {
            // As sharp as camera rays see it.
            Kept::Splats(view) => view.cone.width_after(view.shares.camera.distance(p)),
            _ => self.footprint,
        }
    }

    fn emit(&self, sampler: &Sampler<'_>) -> Option<LightPath<M>> {
        let emitted = self.emitter.emit(
            sampler.pair(Purpose::EmittingLight),
            sampler.pair(Purpose::EmittedDirection),
            sampler.pair(Purpose::EmittedPoint),
        )?;
        let mut ray = emitted.ray;
        if self.needs.motion {
            ray.time = sampler.pair(Purpose::Time).x;
        }
        let source = emitted.source.map(|idx| self.media_of_source[idx as usize]);
        let power = emitted.power * self.share;
        Some(LightPath {
            traveller: Traveller::new(ray, power, source.unwrap_or(M::AIR)),
            history: History::Straight(LightSubpath::emitted(emitted.density, 1.0)),
            depth: 0,
            p_met: ray.origin,
            at_last: None,
            emitted,
        })
    }

    fn meeting(&self, path: &LightPath<M>, vertex: &Vertex<'_, M>) -> Meeting {
        if !self.needs.masks || path.depth > 0 {
            return Meeting::Arrives;
        }
        Meeting::of(self.surfaces.geometry.met_by(vertex.interaction.at))
    }

    /// Keeps a photon where others will look for it, or is seen, and sends the path on.
    fn arrive(
        &self,
        path: &mut LightPath<M>,
        vertex: &Vertex<'_, M>,
        number: u32,
        left: &mut LeftPhotons,
        sampler: &Sampler<'_>,
    ) -> Arrived {
        let surface = &vertex.interaction.surface;
        path.history = path.history.arrived(surface.wo.dot(surface.ng).abs());
        let _shading = self.blame.shading(vertex.interaction.at);
        let bsdf = vertex.interaction.shader.bsdf(surface);
        let seen = bsdf.seen_from(surface.wo);
        if path.depth == 0 {
            path.p_met = surface.p;
        }
        let seen_photon = if let Kept::Splats(view) = self.kept {
            self.see(path, vertex, (number, &bsdf), view, sampler)
        } else {
            self.keep(path, vertex, number, left, &seen);
            None
        };
        Arrived {
            goes_on: self.scatter(path, vertex, &bsdf, &seen, sampler),
            seen: seen_photon,
        }
    }

    /// Keeps what is looked for where a path has arrived.
    fn keep(
        &self,
        path: &LightPath<M>,
        vertex: &Vertex<'_, M>,
        number: u32,
        left: &mut LeftPhotons,
        seen: &SeenBsdf,
    ) {
        let is_caustic = path.history.is_caustic();
        match self.kept {
            Kept::Arrivals => {
                if is_caustic && !path.emitted.is_delta && Aimed::aims_at(seen) {
                    left.arrivals.push(path.arrival(vertex));
                    left.useful_rays.push(path.useful_ray());
                }
            }
            Kept::Irradiance { scouts } => {
                let is_diffuse = !seen.diffuse_albedo().is_black();
                if is_diffuse && left.keep(path.received(vertex, number, seen)) && scouts {
                    left.useful_rays.push(path.useful_ray());
                }
            }
            Kept::All if seen.has_rough_lobes(MIN_ROUGHNESS) => {
                if is_caustic {
                    left.useful_rays.push(path.useful_ray());
                }
                left.keep(path.photon(vertex, number));
            }
            Kept::Caustic if is_caustic && seen.has_rough_lobes(MIN_ROUGHNESS) => {
                left.keep(path.photon(vertex, number));
            }
            Kept::All | Kept::Caustic | Kept::Splats(_) => {}
        }
    }

    /// What the camera sees of a photon at a rough surface, of light that another scattered in a peak first.
    fn see(
        &self,
        path: &LightPath<M>,
        vertex: &Vertex<'_, M>,
        (number, bsdf): (u32, &Bsdf),
        view: &SplatView<'_>,
        sampler: &Sampler<'_>,
    ) -> Option<SeenPhoton> {
        /// Tell the numbers for the lens and for the filter from all else.
        const KEYS: [u32; 4] = [0x2100_0000, 0x2200_0000, 0x2300_0000, 0x2400_0000];
        let at_last = path.at_last?;
        let [lens_x, lens_y, filter_x, filter_y] =
            KEYS.map(|key| unit_f32(sampler.key(key | path.depth)));
        let camera = view.shares.camera;
        let interaction = &vertex.interaction;
        let surface = &interaction.surface;
        let point = camera.see(surface.p, Vec2::new(lens_x, lens_y))?;
        let u = Vec2::new(filter_x, filter_y);
        let (pixel, of_pixels) = view.filter.pixel_around(point.raster, u)?;
        let (wi, wo) = (surface.wo, point.dir);
        let [cos_in, cos_out] = [wi, wo].map(|dir| dir.dot(surface.ng));
        let is_hidden = self.needs.masks
            && Meeting::is_hidden_from_camera(self.surfaces.geometry.met_by(interaction.at));
        let crosses_medium = vertex.bounds_medium() && cos_in * cos_out < 0.0;
        if !view.window.contains(pixel) || is_hidden || crosses_medium {
            return None;
        }
        let seen = bsdf.seen_from(wo);
        if !seen.has_rough_lobes(MIN_ROUGHNESS) {
            return None;
        }
        let eval = seen.eval(wi);
        let at_first = view.shares.at_first(&SeenVertex {
            p: surface.p,
            ng: surface.ng,
            wo,
            wi,
            pdf: eval.pdf,
        });
        let left_to_paths = view.shares.of_path(at_first, at_last);
        // Photons arrive by the area of the true surface; the BSDF has the cosine to the shading normal
        // (Veach 1997, eq. 5.19).
        let pixels_per_area = camera.pixels_per_area(surface.p, wo) * cos_out.abs();
        let media = &path.traveller.media;
        let geometry = self.surfaces.geometry;
        let light = path.traveller.carried
            * media.transmittance(geometry, point.distance)
            * ((1.0 - left_to_paths) * of_pixels * pixels_per_area / cos_in.abs());
        let [diffuse, specular] = [eval.diffuse, eval.specular].map(|share| share * light);
        if (diffuse + specular).is_black() || !(diffuse + specular).is_finite() {
            return None;
        }
        // Aim from the moved origin at the camera.
        let ray = interaction.spawn_ray(wo, VIEW_T_MAX, Visibility::CAMERA);
        let ray = Ray {
            dir: surface.p + wo * point.distance - ray.origin,
            ..ray
        };
        let least_priority = media.least_priority(geometry);
        let question = Question::occluded::<CUTOUTS>(&ray, least_priority, sampler, path.depth);
        let splat = Splat {
            pixel,
            path_idx: number,
            diffuse,
            specular,
            left: left_to_paths,
        };
        Some(SeenPhoton {
            question,
            splat,
            is_scout: view.scouts,
        })
    }

    /// Sends a path on; false where it ends.
    ///
    /// Paths end by chance as often as surfaces absorb light (Arvo & Kirk 1990), so that photons
    /// that are left are about as powerful as those that were emitted.
    fn scatter(
        &self,
        path: &mut LightPath<M>,
        vertex: &Vertex<'_, M>,
        bsdf: &Bsdf,
        seen: &SeenBsdf,
        sampler: &Sampler<'_>,
    ) -> bool {
        let surface = &vertex.interaction.surface;
        let depth = path.depth;
        let u = sampler.pair(Purpose::Direction(depth));
        let u = [sampler.pair(Purpose::Choice(depth)).y, u.x, u.y];
        let Some(scattered) = sample_adjoint(bsdf, seen, surface.ng, surface.wo, u) else {
            return false;
        };
        let drawn = self.draw_lobes(path, &scattered, seen, sampler);
        let before = path.traveller.carried;
        let [diffuse, specular] = path.scattered(&scattered);
        let after = before * (diffuse * drawn.shares[0] + specular * drawn.shares[1]);
        let survival = (after.max_channel() / before.max_channel()).min(1.0);
        // What is not a number ends here too.
        let is_alive = unit_f32(sampler.key(0x8000_0000 | depth)) < survival;
        if !is_alive || !after.is_finite() {
            return false;
        }
        if matches!(self.kept, Kept::Splats(_)) && path.depth == 0 {
            path.at_last = self.at_last(path, vertex, &scattered);
            if path.at_last.is_none() {
                return false;
            }
        }
        path.history = if drawn.are_narrow {
            let reverse_pdf = self.reverse_pdf(path, vertex, bsdf, &scattered);
            let cos_out = scattered.wo.dot(surface.ng).abs();
            path.history.reflected(scattered.pdf, reverse_pdf, cos_out)
        } else {
            match self.kept {
                Kept::All | Kept::Irradiance { .. } | Kept::Splats(_) => History::Scattered,
                Kept::Caustic | Kept::Arrivals => return false,
            }
        };
        let traveller = &mut path.traveller;
        traveller.carried = after / survival;
        traveller.leave(vertex, scattered.wo, scattered.is_transmission);
        path.depth += 1;
        true
    }

    /// The ratio of densities at the first surface, if it scattered light in a peak.
    fn at_last(
        &self,
        path: &LightPath<M>,
        vertex: &Vertex<'_, M>,
        scattered: &ScatteredLight,
    ) -> Option<f32> {
        let EmittedPhoton {
            light,
            density,
            is_delta,
            ..
        } = path.emitted;
        if scattered.is_delta {
            let pdfs = LightPdfs {
                pdf: 1.0,
                connect_pdf: 0.0,
                is_delta,
            };
            return Some(SplatShares::at_last(density, pdfs));
        }
        let surface = &vertex.interaction.surface;
        let receiver = Receiver::facing(surface.p, surface.ns, scattered.wo);
        let (wi, distance) = (surface.wo, vertex.distance);
        (scattered.reverse_pdf >= MIN_PEAK).then(|| {
            let pdfs = LightPdfs {
                pdf: scattered.reverse_pdf,
                connect_pdf: self.emitter.connection_pdf(light, receiver, wi, distance),
                is_delta,
            };
            SplatShares::at_last(density, pdfs)
        })
    }

    /// By which lobes light goes on, so far as its class matters.
    fn draw_lobes(
        &self,
        path: &LightPath<M>,
        scattered: &ScatteredLight,
        seen: &SeenBsdf,
        sampler: &Sampler<'_>,
    ) -> DrawnLobes {
        let whole = |are_narrow| {
            if are_narrow {
                DrawnLobes::NARROW
            } else {
                DrawnLobes::ROUGH
            }
        };
        match self.kept {
            // To aim at a light, narrow lobes are mirrors, whatever else the surface has: no weight
            // depends on the class then.
            Kept::Arrivals => whole(scattered.roughness < MIN_GUIDED_ROUGHNESS),
            Kept::Irradiance { .. } => whole(is_specular(scattered.is_delta, seen)),
            Kept::Splats(_) => DrawnLobes::ROUGH,
            _ if is_specular(scattered.is_delta, seen) => DrawnLobes::NARROW,
            Kept::All | Kept::Caustic => {
                let [_, specular] = path.multipliers();
                let narrow = scattered.narrow * specular;
                let u = unit_f32(sampler.key(LOBES_KEY | path.depth));
                DrawnLobes::draw(path.scattered(scattered), narrow, u)
            }
        }
    }

    /// Density with which camera paths that come the other way find what the light came from: by
    /// scattering, and at the first surface also by choosing a direction to the light.
    fn reverse_pdf(
        &self,
        path: &LightPath<M>,
        vertex: &Vertex<'_, M>,
        bsdf: &Bsdf,
        scattered: &ScatteredLight,
    ) -> f32 {
        if !path.history.is_straight() {
            return scattered.reverse_pdf;
        }
        let by_scattering = if path.emitted.is_delta {
            0.0
        } else if path.emitted.source.is_none()
            && scattered.is_mirrored()
            && self.emitter.is_glint(bsdf, scattered.wo)
        {
            // They connect by the mirror.
            1.0
        } else {
            scattered.reverse_pdf
        };
        if scattered.is_delta {
            return by_scattering;
        }
        let surface = &vertex.interaction.surface;
        let receiver = Receiver::facing(surface.p, surface.ns, scattered.wo);
        let light = path.emitted.light;
        let by_light = self
            .emitter
            .connection_pdf(light, receiver, surface.wo, vertex.distance);
        by_scattering + by_light
    }
}

impl<M: Media> LightPath<M> {
    /// What the light's multipliers make of scattering by diffuse and by specular lobes.
    fn multipliers(&self) -> [f32; 2] {
        if self.history.is_straight() {
            [self.emitted.diffuse, self.emitted.specular]
        } else {
            [1.0; 2]
        }
    }

    /// What diffuse and what other lobes scatter, as shares of what arrived.
    fn scattered(&self, light: &ScatteredLight) -> [Spectrum; 2] {
        let [diffuse, specular] = self.multipliers();
        [light.diffuse * diffuse, light.specular * specular]
    }

    /// The photon that is left where the path has arrived.
    fn photon(&self, vertex: &Vertex<'_, M>, number: u32) -> Photon {
        let [diffuse, _] = self.multipliers();
        let surface = &vertex.interaction.surface;
        Photon {
            p: surface.p,
            power: self.traveller.carried * diffuse,
            wi: surface.wo,
            n: vertex.n(),
            light_idx: self.emitted.light,
            class: self.history.class(),
            path_idx: number,
            depth: u16::try_from(self.depth).unwrap_or(u16::MAX),
        }
    }

    /// The photon that stands for what diffuse lobes receive: photons arrive by the area of the true
    /// surface, and shading has its own cosine (Veach 1997, eq. 5.19).
    fn received(&self, vertex: &Vertex<'_, M>, number: u32, seen: &SeenBsdf) -> Photon {
        let photon = self.photon(vertex, number);
        let cos_true = photon.wi.dot(photon.n);
        Photon {
            power: photon.power * (seen.diffuse_reception() / cos_true),
            class: PhotonClass::Global,
            ..photon
        }
    }

    /// What a camera path would find that went where the light comes from.
    fn arrival(&self, vertex: &Vertex<'_, M>) -> GatherRecord {
        let EmittedPhoton { power, density, .. } = self.emitted;
        let surface = &vertex.interaction.surface;
        let irradiance = self.traveller.carried.luminance();
        GatherRecord {
            p: surface.p,
            n: if surface.ns.dot(surface.wo) < 0.0 {
                -surface.ns
            } else {
                surface.ns
            },
            arrival: Arrival {
                wi: surface.wo,
                irradiance,
                // As if the camera path had met the light with the weight that makes this power of
                // its radiance, per unit of area.
                pdf: (power * density).luminance() / irradiance,
            },
            pixel: [0; 2],
            brought: 0.0,
        }
    }

    /// How the light of a photon left.
    fn useful_ray(&self) -> UsefulRay {
        let EmittedPhoton {
            light,
            density,
            ray,
            ..
        } = self.emitted;
        UsefulRay {
            light,
            dir: ray.dir,
            p_met: self.p_met,
            luminance: self.traveller.carried.luminance(),
            density,
        }
    }

    /// Of light that a surface lets through as a whole and receives as a whole, follows one half,
    /// with the power of both: whether it is the one that goes through.
    fn goes_on_behind(&mut self, vertex: &Vertex<'_, M>, sampler: &Sampler<'_>) -> bool {
        self.traveller.carried *= 2.0;
        // Another number for each surface on the way.
        let key = sampler.key(0x4000_0000 | vertex.distance.to_bits() >> 2);
        let goes_on = unit_f32(key) < 0.5;
        if goes_on {
            self.traveller.pass(vertex);
        }
        goes_on
    }
}

impl LeftPhotons {
    /// Adds what the next paths left.
    pub(super) fn append(&mut self, next: Self) {
        self.photons.extend(next.photons);
        self.brightest = self.brightest.max(next.brightest);
        self.useful_rays.extend(next.useful_rays);
        self.arrivals.extend(next.arrivals);
        self.splats.extend(next.splats);
        self.sent_out += next.sent_out;
        self.counts.add(&next.counts);
    }

    /// Keeps what the camera sees of a photon of a path.
    fn see<M: Media>(&mut self, seen: &SeenPhoton, path: &LightPath<M>) {
        let splat = seen.splat;
        self.counts.stored_caustic += 1;
        self.splats.push(splat);
        if seen.is_scout {
            self.useful_rays.push(UsefulRay {
                luminance: (splat.diffuse + splat.specular).luminance(),
                ..path.useful_ray()
            });
        }
    }

    /// Keeps a photon, unless it carries nothing.
    fn keep(&mut self, photon: Photon) -> bool {
        if photon.power == Spectrum::BLACK {
            return false;
        }
        match photon.class {
            PhotonClass::Caustic { .. } => self.counts.stored_caustic += 1,
            PhotonClass::Global => self.counts.stored_global += 1,
        }
        if photon.is_valid() {
            self.brightest = self.brightest.max(photon.power.max_channel());
        }
        self.photons.push(photon);
        true
    }
}
