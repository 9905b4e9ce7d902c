//! A cheap look from the camera: where the image needs light (Peter & Pietrek 1998, "Importance
//! Driven Construction of Photon Maps").

use kilauea_math::hash::unit_f32;
use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_spot::{Context, Program};

use super::MIN_ROUGHNESS;
use super::surfaces::{Surfaces, Traveller, Vertex};
use crate::RenderError;
use crate::camera::RayGenerator;
use crate::follow::{Follow, Workforce, follow_some};
use crate::integrator::{Air, Answer, Blame, Media, MediumStack, Question, RayTracer};
use crate::light::Receiver;
use crate::prepared::PreparedScene;
use crate::sampler::{PixelSequence, Purpose, Sampler, SamplerTables};

/// How to look.
#[derive(Clone, Copy, Debug)]
pub struct ImportonRequest {
    /// Width and height of the picture in pixels.
    pub resolution: [u32; 2],
    /// One path leaves the camera for each square of so many pixels.
    pub block: u32,
    /// Surfaces that a path meets at most.
    pub max_depth: u32,
    /// Rough surfaces after which a path ends.
    pub max_rough: u32,
    /// Makes other, equally good importons.
    pub seed: u32,
    /// Engine threads.
    pub n_threads: usize,
}

impl ImportonRequest {
    /// The first rough surface in each pixel.
    pub(crate) fn of_pixels(resolution: [u32; 2], n_threads: usize) -> Self {
        Self {
            resolution,
            block: 1,
            max_depth: 16,
            max_rough: 1,
            seed: 0,
            n_threads,
        }
    }
}

/// Where light would reach the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Importon {
    /// Which block of pixels it is from, row after row.
    pub block: u32,
    /// How many rough surfaces its path had met before.
    pub n_rough: u32,
    /// Where, engine space.
    pub p: Vec3,
    /// Unit geometric normal on the side that is seen.
    pub n: Vec3,
    /// Unit shading normal on the side that is seen.
    pub n_shading: Vec3,
    /// The share of light from here that reaches the camera.
    pub throughput: Spectrum,
    /// The share of light that the surface scatters.
    pub albedo: Spectrum,
    /// Width of the block as seen from the camera here.
    pub width: f32,
}

/// Looks at a scene from its camera. Importons are in the order of their blocks.
///
/// # Errors
/// If a shader panics.
pub fn trace_importons(
    prepared: &PreparedScene,
    request: &ImportonRequest,
) -> Result<Vec<Importon>, RenderError> {
    let needs = &prepared.needs;
    match (needs.media, needs.cutouts || needs.nested_media) {
        (false, false) => trace::<false, Air>(prepared, request),
        (false, true) => trace::<true, Air>(prepared, request),
        (true, false) => trace::<false, MediumStack>(prepared, request),
        (true, true) => trace::<true, MediumStack>(prepared, request),
    }
}

fn trace<const CUTOUTS: bool, M: Media>(
    prepared: &PreparedScene,
    request: &ImportonRequest,
) -> Result<Vec<Importon>, RenderError> {
    /// Keeps the numbers of importons apart from those of other paths.
    const IMPORTON_SEED: u32 = 0x2f6e_2b17;
    let PreparedScene {
        geometry, textures, ..
    } = prepared;
    let scene = &prepared.scene;
    let [columns, rows] = request.resolution.map(|n| n.div_ceil(request.block.max(1)));
    let n_blocks = columns.saturating_mul(rows);
    let tables = SamplerTables::new(n_blocks, request.max_depth, request.seed ^ IMPORTON_SEED);
    let camera = RayGenerator::new(&prepared.camera, request.resolution, scene.origin_world);
    let center = Vec2::new(request.resolution[0] as f32, request.resolution[1] as f32) / 2.0;
    let ray = camera.ray(center, Vec2::splat(0.5), 0.0).ray;
    let blame = Blame::default();
    let tracer = ImportonTracer::<CUTOUTS, M> {
        surfaces: Surfaces { geometry, textures },
        blame: &blame,
        request,
        columns,
        has_motion: prepared.needs.motion,
        camera,
        camera_media: M::around(ray.at(ray.t_min), &RayTracer::of(prepared, &blame)),
        sequence: tables.pixel([0, 0]),
    };
    let answerer = RayTracer::<CUTOUTS>::of(prepared, &blame);
    let workforce = Workforce::inline(request.n_threads);
    let left = follow_some(&tracer, 0..n_blocks, &answerer, workforce)
        .map_err(|error| RenderError::of_run(error, &blame, geometry))?;
    Ok(left.concat())
}

/// Follows paths from the camera.
struct ImportonTracer<'a, const CUTOUTS: bool, M> {
    surfaces: Surfaces<'a>,
    blame: &'a Blame,
    request: &'a ImportonRequest,
    /// Blocks in a row.
    columns: u32,
    has_motion: bool,
    camera: RayGenerator,
    camera_media: M,
    sequence: PixelSequence<'a>,
}

/// A path from the camera.
struct CameraPath<M> {
    /// Carries the share of light that reaches the camera.
    traveller: Traveller<M>,
    depth: u32,
    n_rough: u32,
    /// Distance from the camera.
    travelled: f32,
}

impl<const CUTOUTS: bool, M: Media> Follow for ImportonTracer<'_, CUTOUTS, M> {
    type Left = Vec<Importon>;

    async fn follow<P, C>(&self, number: u32, left: &mut Vec<Importon>, cx: &C)
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let sampler = self.sequence.sampler(number);
        let mut path = self.leave_camera(number, &sampler);
        while path.depth < self.request.max_depth && path.n_rough < self.request.max_rough {
            let ray = &path.traveller.ray;
            let question = Question::closest::<CUTOUTS>(ray, &sampler, path.depth);
            let (hit, carried) = cx.ask(question).await.hit();
            let Some(hit) = hit else { break };
            let footprint = self.width(path.travelled + hit.t);
            let hit = (hit, carried.as_deref());
            let vertex = self.surfaces.meet(&mut path.traveller, hit, footprint);
            let Some(vertex) = vertex else { continue };
            path.travelled += vertex.distance;
            if !self.arrive(&mut path, &vertex, number, left, &sampler) {
                break;
            }
        }
    }
}

impl<const CUTOUTS: bool, M: Media> ImportonTracer<'_, CUTOUTS, M> {
    fn leave_camera(&self, number: u32, sampler: &Sampler<'_>) -> CameraPath<M> {
        let corner = Vec2::new(
            (number % self.columns) as f32,
            (number / self.columns) as f32,
        );
        let raster = (corner + sampler.pair(Purpose::Filter)) * self.request.block as f32;
        let time = if self.has_motion {
            sampler.pair(Purpose::Time).x
        } else {
            0.0
        };
        let ray = self
            .camera
            .ray(raster, sampler.pair(Purpose::Lens), time)
            .ray;
        CameraPath {
            traveller: Traveller::new(ray, Spectrum::ONE, self.camera_media),
            depth: 0,
            n_rough: 0,
            travelled: 0.0,
        }
    }

    /// Width of a block, as far away.
    fn width(&self, distance: f32) -> f32 {
        self.request.block as f32 * self.camera.pixel_width(distance)
    }

    /// Leaves an importon where light would be looked for, and sends the path on; false where it
    /// ends.
    fn arrive(
        &self,
        path: &mut CameraPath<M>,
        vertex: &Vertex<'_, M>,
        number: u32,
        left: &mut Vec<Importon>,
        sampler: &Sampler<'_>,
    ) -> bool {
        let interaction = &vertex.interaction;
        let surface = &interaction.surface;
        let _shading = self.blame.shading(interaction.at);
        let seen = interaction.shader.bsdf(surface).seen_from(surface.wo);
        let traveller = &mut path.traveller;
        if seen.has_rough_lobes(MIN_ROUGHNESS) {
            left.push(Importon {
                block: number,
                n_rough: path.n_rough,
                p: surface.p,
                n: vertex.n(),
                n_shading: Receiver::facing(surface.p, surface.ns, surface.wo).n,
                throughput: traveller.carried,
                albedo: seen.albedo(),
                width: self.width(path.travelled),
            });
            path.n_rough += 1;
        }
        let depth = path.depth;
        let u = sampler.pair(Purpose::Direction(depth));
        let u = [sampler.pair(Purpose::Choice(depth)).y, u.x, u.y];
        let Some(sample) = seen.sample(u) else {
            return false;
        };
        // Ends as often as surfaces absorb light.
        let after = traveller.carried * sample.weight();
        let survival = (after.max_channel() / traveller.carried.max_channel()).min(1.0);
        let is_alive = unit_f32(sampler.key(0x8000_0000 | depth)) < survival;
        if !is_alive || !after.is_finite() {
            return false;
        }
        traveller.carried = after / survival;
        traveller.leave(vertex, sample.wi, sample.is_transmission);
        path.depth += 1;
        true
    }
}
