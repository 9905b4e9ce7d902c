use serde::Serialize;

use crate::{
    Agreement, BuildRow, Device, Embree, EmbreeScene, Mode, Ours, PeerError, Tracer, Workload,
    mrays_per_s,
};

/// How much is measured.
#[derive(Clone, Debug)]
pub struct MeasureOptions {
    /// Rounds of each batch of rays; the best counts.
    pub n_rounds: usize,
    /// Numbers of threads that trees are built with; none to measure no builds.
    pub build_threads: Vec<usize>,
}

/// Rays per second of one of our trees and one of Embree's.
#[derive(Clone, Debug, Serialize)]
pub struct RayRow {
    /// Name of the mesh.
    pub mesh: String,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Kind of rays.
    pub rays: String,
    /// How many rays.
    pub n_rays: usize,
    /// Share of the rays that hit something.
    pub hit_fraction: f64,
    /// [`Ours::NAME`].
    pub ours_name: &'static str,
    /// Million rays a second, ours.
    pub ours: f64,
    /// Library, version and mode.
    pub peer_name: String,
    /// Million rays a second, the peer's.
    pub peer: f64,
    /// Ours over the peer's.
    pub ratio: f64,
    /// Rays that one of the two found to hit.
    pub hit_by_one: usize,
    /// Rays that hit at different distances.
    pub other_distance: usize,
    /// Whether these two are few enough ([`Agreement::MAX_FRACTION`]).
    pub agrees: bool,
}

/// What was measured of one workload.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Tracing.
    pub rows: Vec<RayRow>,
    /// Building.
    pub builds: Vec<BuildRow>,
}

/// The modes of Embree that rays are traced in.
const PEERS: [Mode; 3] = [Mode::MEDIUM, Mode::HIGH, Mode::ROBUST];

/// Measures ours beside Embree: builds first, then rays, on the calling thread.
pub fn measure(
    embree: &Embree,
    workload: &Workload,
    options: &MeasureOptions,
) -> Result<Report, PeerError> {
    let mut builds = Vec::new();
    for &n_threads in &options.build_threads {
        builds.extend(BuildRow::of_all(embree, workload, n_threads)?);
    }
    let device = Device::new(embree, 1)?;
    let mesh = &workload.mesh;
    let ours = Ours::build(mesh);
    let scenes = PEERS.map(|mode| EmbreeScene::build(&device, mesh, mode));
    let scenes = scenes.into_iter().collect::<Result<Vec<_>, _>>()?;
    let peers = scenes.iter().map(|scene| scene as &dyn Tracer);
    let tracers: Vec<&dyn Tracer> = std::iter::once(&ours as &dyn Tracer).chain(peers).collect();
    let mut rows = Vec::new();
    for set in &workload.rays {
        let rates = mrays_per_s(&tracers, set, options.n_rounds);
        for (peer_idx, mode) in (1..).zip(PEERS) {
            let agreement = Agreement::of(tracers[0], tracers[peer_idx], set);
            rows.push(RayRow {
                mesh: workload.name.clone(),
                triangles: mesh.triangles().len(),
                rays: set.kind.clone(),
                n_rays: set.rays.len(),
                hit_fraction: agreement.n_hits as f64 / set.rays.len() as f64,
                ours_name: Ours::NAME,
                ours: rates[0],
                peer_name: format!("{} {}", device.name(), mode.name),
                peer: rates[peer_idx],
                ratio: rates[0] / rates[peer_idx],
                hit_by_one: agreement.n_hit_by_one,
                other_distance: agreement.n_other_distance,
                agrees: agreement.is_within_tolerance(set.rays.len()),
            });
        }
    }
    Ok(Report { rows, builds })
}
