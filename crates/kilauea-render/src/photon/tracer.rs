use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_bsdf::{Bsdf, SeenBsdf};
use kilauea_math::hash::unit_f32;
use kilauea_math::{Spectrum, Vec2};
use kilauea_photon::{LightSubpath, Photon, PhotonClass};
use kilauea_spot::{Context, Program};
use kilauea_texture::TextureStore;

use super::meeting::Meeting;
use super::path::{History, LightPath};
use super::program::Traced;
use super::scatter::{ScatteredLight, sample_adjoint};
use super::{MIN_ROUGHNESS, PhotonRequest};
use crate::geometry::{Geometry, Interaction, View};
use crate::integrator::{Answer, Blame, Boundary, Media, Question};
use crate::light::{EmittedPhoton, Emitter, Receiver};
use crate::needs::SceneNeeds;
use crate::prepared::PreparedScene;
use crate::sampler::{PixelSequence, Purpose, Sampler, SamplerTables};

/// Follows photons from surface to surface. `CUTOUTS` and `M` as in the path integrator.
pub(super) struct PhotonTracer<'a, const CUTOUTS: bool, M> {
    emitter: &'a Emitter<'a>,
    geometry: &'a Geometry,
    textures: &'a TextureStore,
    blame: &'a Blame,
    needs: SceneNeeds,
    max_depth: u32,
    /// One over the number of paths.
    share: f32,
    /// Width of what a photon stands for: textures need not be sharper.
    footprint: f32,
    sequence: PixelSequence<'a>,
    /// The media that a source of light is in.
    media_of_source: Vec<M>,
}

/// Where a path has arrived.
struct Vertex<'a, M> {
    interaction: Interaction<'a>,
    /// None on surfaces that bound no medium.
    boundary: Option<Boundary<M>>,
    /// From where the path scattered last.
    distance: f32,
}

/// What a ray of a path leads to.
enum Arrival<'a, M> {
    /// The path has arrived.
    At(Box<Vertex<'a, M>>),
    /// Nothing is here for this path, which goes on behind.
    Behind(Ray),
    /// The path ends, and nothing sees where.
    Nowhere,
}

impl<'a, const CUTOUTS: bool, M: Media> PhotonTracer<'a, CUTOUTS, M> {
    pub(super) fn new(
        emitter: &'a Emitter<'a>,
        prepared: &'a PreparedScene,
        blame: &'a Blame,
        request: &PhotonRequest,
        needs: SceneNeeds,
        tables: &'a SamplerTables,
    ) -> Self {
        let PreparedScene {
            geometry, textures, ..
        } = prepared;
        let media = |p| M::around(p, geometry, textures);
        Self {
            emitter,
            geometry,
            textures,
            blame,
            needs,
            max_depth: request.max_depth,
            share: 1.0 / request.n_emitted as f32,
            footprint: (emitter.mean_cross_section() / request.n_emitted as f32).sqrt(),
            sequence: tables.pixel([0, 0]),
            media_of_source: emitter.sources().map(media).collect(),
        }
    }

    /// Follows the path with that number, and keeps its photons.
    pub(super) async fn trace<P, C>(&self, path_idx: u32, traced: &mut Traced, cx: &C)
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        traced.counts.emitted += 1;
        let sampler = self.sequence.sampler(path_idx);
        let Some(emitted) = self.emit(&sampler) else {
            return;
        };
        let mut path = self.start(&emitted, &sampler);
        let mut ray = path.ray;
        let mut depth = 0;
        while depth < self.max_depth {
            traced.counts.rays += 1;
            let question = Question::closest::<CUTOUTS>(&ray, &sampler, depth);
            let Some(hit) = cx.ask(question).await.hit() else {
                traced.counts.invalid_rays += u64::from(!ray.is_valid());
                break;
            };
            let vertex = match self.arrive(&mut path, hit, depth, &sampler) {
                Arrival::At(vertex) => vertex,
                Arrival::Behind(next) => {
                    ray = next;
                    continue;
                }
                Arrival::Nowhere => break,
            };
            let _shading = self.blame.shading(self.geometry, vertex.interaction.at);
            let surface = &vertex.interaction.surface;
            let bsdf = vertex.interaction.shader.bsdf(surface);
            let seen = bsdf.seen_from(surface.wo);
            if seen.max_roughness() >= Some(MIN_ROUGHNESS) {
                let photon = keep(&path, &vertex, &emitted, path_idx, depth);
                traced.keep(photon);
            }
            let is_alive = self.scatter(
                &mut path,
                &vertex,
                &emitted,
                (&bsdf, &seen),
                depth,
                &sampler,
            );
            if !is_alive {
                break;
            }
            ray = path.ray;
            depth += 1;
        }
        traced.counts.in_too_many_media += u64::from(path.media.has_overflowed());
    }

    fn emit(&self, sampler: &Sampler<'_>) -> Option<EmittedPhoton> {
        self.emitter.emit(
            sampler.pair(Purpose::EmittingLight),
            sampler.pair(Purpose::EmittedDirection),
            sampler.pair(Purpose::EmittedPoint),
        )
    }

    fn start(&self, emitted: &EmittedPhoton, sampler: &Sampler<'_>) -> LightPath<M> {
        let time = if self.needs.motion {
            sampler.pair(Purpose::Time).x
        } else {
            0.0
        };
        let source = emitted.source.map(|idx| self.media_of_source[idx as usize]);
        LightPath {
            ray: Ray {
                time,
                ..emitted.ray
            },
            power: emitted.power * self.share,
            media: source.unwrap_or(M::AIR),
            history: History::Straight(LightSubpath::emitted(emitted.density, 1.0)),
        }
    }

    /// What a hit means for a path. What media absorb on the way is taken from its power.
    fn arrive(
        &self,
        path: &mut LightPath<M>,
        hit: Hit,
        depth: u32,
        sampler: &Sampler<'_>,
    ) -> Arrival<'a, M> {
        let hit = path.media.since_departure(hit);
        let mut interaction = self.interaction(&hit, &path.ray);
        let Ray {
            dir, visibility, ..
        } = path.ray;
        let behind = interaction.spawn_ray(dir, f32::INFINITY, visibility);
        let boundary = path.media.boundary(self.geometry, &interaction);
        if let Some(boundary) = boundary.filter(|b| b.is_hidden) {
            path.media.pass(&boundary, hit.t);
            path.ray.t_min = hit.t;
            return Arrival::Behind(behind);
        }
        path.power *= path.media.transmittance(self.geometry, hit.t);
        if self.needs.masks && depth == 0 {
            match Meeting::of(self.geometry.met_by(interaction.at)) {
                Meeting::Arrives => {}
                Meeting::Blocked => return Arrival::Nowhere,
                Meeting::Divides => {
                    // One half of the light each, of which one is followed.
                    path.power *= 2.0;
                    let key = sampler.key(0x4000_0000 | hit.t.to_bits() >> 2);
                    if unit_f32(key) < 0.5 {
                        path.media.depart();
                        path.ray = behind;
                        return Arrival::Behind(behind);
                    }
                }
            }
        }
        if let Some(boundary) = &boundary {
            interaction.surface.outside_ior = boundary.outside_ior;
        }
        Arrival::At(Box::new(Vertex {
            interaction,
            boundary,
            distance: hit.t,
        }))
    }

    fn interaction(&self, hit: &Hit, ray: &Ray) -> Interaction<'a> {
        let view = View {
            uv: Vec2::new(hit.u, hit.v),
            p_ray: ray.at(hit.t),
            wo: -ray.dir,
            time: ray.time,
            footprint: self.footprint,
        };
        let at = self.geometry.locate(hit);
        self.geometry.interaction(at, &view, self.textures)
    }

    /// Sends a path on; false where it ends.
    ///
    /// Paths end by chance as often as surfaces absorb light (Arvo & Kirk 1990), so that photons
    /// that are left are about as powerful as those that were emitted.
    fn scatter(
        &self,
        path: &mut LightPath<M>,
        vertex: &Vertex<'a, M>,
        emitted: &EmittedPhoton,
        (bsdf, seen): (&Bsdf, &SeenBsdf),
        depth: u32,
        sampler: &Sampler<'_>,
    ) -> bool {
        let surface = &vertex.interaction.surface;
        let (ng, wi) = (surface.ng, surface.wo);
        let u = sampler.pair(Purpose::Direction(depth));
        let u_lobe = sampler.pair(Purpose::Choice(depth)).y;
        let Some(scattered) = sample_adjoint(bsdf, seen, ng, wi, [u_lobe, u.x, u.y]) else {
            return false;
        };
        let history = path.history.arrived(wi.dot(ng).abs());
        let (diffuse, specular) = if history.is_straight() {
            (emitted.diffuse, emitted.specular)
        } else {
            (1.0, 1.0)
        };
        let share = scattered.diffuse * diffuse + scattered.specular * specular;
        let power = path.power * share;
        let survival = (power.max_channel() / path.power.max_channel()).min(1.0);
        // What is not a number ends here too.
        let is_alive = unit_f32(sampler.key(0x8000_0000 | depth)) < survival;
        if !is_alive || !power.is_finite() {
            return false;
        }
        path.power = power / survival;
        path.history = if scattered.roughness < MIN_ROUGHNESS {
            let reverse_pdf = self.reverse_pdf(history, vertex, emitted, &scattered);
            let cos_out = scattered.wo.dot(ng).abs();
            history.reflected(scattered.pdf, reverse_pdf, cos_out)
        } else {
            History::Scattered
        };
        if scattered.is_transmission
            && let Some(boundary) = &vertex.boundary
        {
            path.media.cross(boundary);
        }
        path.media.depart();
        path.ray = vertex
            .interaction
            .spawn_ray(scattered.wo, f32::INFINITY, Visibility::INDIRECT);
        true
    }

    /// Density with which camera paths that come the other way find what the light came from: by
    /// scattering, and at the first surface also by choosing a direction to the light.
    fn reverse_pdf(
        &self,
        history: History,
        vertex: &Vertex<'_, M>,
        emitted: &EmittedPhoton,
        scattered: &ScatteredLight,
    ) -> f32 {
        if !history.is_straight() {
            return scattered.reverse_pdf;
        }
        let by_scattering = if emitted.is_delta {
            0.0
        } else {
            scattered.reverse_pdf
        };
        if scattered.is_delta {
            return by_scattering;
        }
        let surface = &vertex.interaction.surface;
        let receiver = Receiver::facing(surface.p, surface.ns, scattered.wo);
        let distance = vertex.distance;
        by_scattering
            + self
                .emitter
                .connection_pdf(emitted.light, receiver, surface.wo, distance)
    }
}

/// The photon that a path leaves where it has arrived.
fn keep<M>(
    path: &LightPath<M>,
    vertex: &Vertex<'_, M>,
    emitted: &EmittedPhoton,
    path_idx: u32,
    depth: u32,
) -> Photon {
    let surface = &vertex.interaction.surface;
    let (wi, ng) = (surface.wo, surface.ng);
    let history = path.history.arrived(wi.dot(ng).abs());
    let power = if history.is_straight() {
        path.power * emitted.diffuse
    } else {
        path.power
    };
    Photon {
        p: surface.p,
        power,
        wi,
        n: if wi.dot(ng) < 0.0 { -ng } else { ng },
        light_idx: emitted.light,
        class: history.class(),
        path_idx,
        depth: u16::try_from(depth).unwrap_or(u16::MAX),
    }
}

impl Traced {
    fn keep(&mut self, photon: Photon) {
        if photon.power == Spectrum::BLACK {
            return;
        }
        match photon.class {
            PhotonClass::Caustic { .. } => self.counts.stored_caustic += 1,
            PhotonClass::Global => self.counts.stored_global += 1,
        }
        self.photons.push(photon);
    }
}
