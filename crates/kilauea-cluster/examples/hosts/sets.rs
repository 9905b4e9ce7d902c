//! Workers that hold a part of the scene each.
//!
//! The simulator is told what a worker with the whole scene takes for a ray, and what a set of two
//! without slow links takes for a question; sets of other sizes and on other networks it has to tell
//! itself. Whom a whole ray would ask is known from a frame of as many members in this process, and how
//! many others are asked when members have looked at home from the frame without slow links.

use std::path::Path;
use std::sync::Arc;

use kilauea_cluster::{ClusterOptions, SetOptions, SetSize, WorkerKind};
use kilauea_render::{
    Broadcast, Conditions, Packing, PrepareOptions, PreparedScene, RayTraffic, RenderJob, SetPlan,
    SetStats,
};
use kilauea_scene::RenderSettings;
use kilauea_sim::{Batching, Machine, RaySizes, RayTrace, SetModel, TracedRay};
use kilauea_tests::Stage;

use crate::Asked;
use crate::measured::{Outcome, Row, Shot, Timed, bytes_per_sec, working_secs};
use crate::namespaces::{CONSOLE, Hosts};
use crate::spread_stage::many_spheres;

/// Megabytes a second of each host; 0 is as fast as can be.
const NETWORKS: [f64; 3] = [0.0, 16.0, 4.0];
/// Of the time that a worker with the whole scene takes for a ray, what goes to tracing it.
const TRACING_SHARE: f64 = 0.5;
/// Rays that a worker of one thread has under way.
const POOL: usize = 2048;

/// What the simulator is told.
struct Known {
    trace: RayTrace,
    machine: Machine,
    sizes: RaySizes,
    n_rays: f64,
}

pub(crate) fn rows(asked: &Asked) -> Outcome<Vec<Row>> {
    let shot = shot();
    let best = |n_members: usize, megabytes: f64| -> Outcome<Timed> {
        let mut best = render(&shot, n_members, megabytes, &asked.worker)?;
        for _ in 1..asked.n_runs {
            let timed = render(&shot, n_members, megabytes, &asked.worker)?;
            if working_secs(&timed) < working_secs(&best) {
                best = timed;
            }
        }
        Ok(best)
    };
    let most = asked.n_hosts.iter().copied().max().ok_or("no hosts")?;
    let known = Known::new(trace(&shot, most)?, &best(1, 0.0)?, &best(2, 0.0)?)?;
    let mut rows = Vec::new();
    for &n_hosts in &asked.n_hosts {
        let mut n_others = None;
        for megabytes in NETWORKS {
            let timed = best(n_hosts, megabytes)?;
            let n_others = *n_others.get_or_insert(others_per_ray(&timed)?);
            let row = Row {
                megabytes,
                delay_ms: 0.0,
                n_workers: n_hosts,
                seconds: working_secs(&timed),
                predicted: known.seconds(n_hosts, n_others, bytes_per_sec(megabytes)),
            };
            rows.push(row.told());
        }
    }
    Ok(rows)
}

/// Many chunks, so that members differ little.
fn shot() -> Shot {
    let settings = RenderSettings {
        resolution: [256, 144],
        samples_per_pixel: 16,
        max_depth: 6,
        threads: 1,
        ..Stage::settings()
    };
    Shot {
        scene: many_spheres().scene(settings.resolution),
        settings,
    }
}

fn render(shot: &Shot, n_members: usize, megabytes: f64, worker: &Path) -> Outcome<Timed> {
    let mut hosts = Hosts::new(n_members, 1e6 * megabytes)?;
    let set = SetOptions {
        size: SetSize::Workers(n_members as u32),
        broadcast: Broadcast::Culled,
        packing: Packing::Plain,
    };
    let options = ClusterOptions {
        set: (n_members > 1).then_some(set),
        ..ClusterOptions::new(n_members as u32, WorkerKind::Elsewhere { host: CONSOLE })
    };
    let timed = shot.render(options, &mut |ticket| {
        hosts.start(ticket.rank as usize, worker, &ticket)
    })?;
    hosts.wait()?;
    Ok(timed)
}

/// Whom rays ask, of so many members.
fn trace(shot: &Shot, n_members: usize) -> Outcome<RayTrace> {
    let plan = SetPlan::even(&shot.scene, n_members)?;
    let prepared = PreparedScene::spread(&shot.scene, &plan, &PrepareOptions::default())?;
    let conditions = Conditions {
        sample_one_in: 40,
        ..Conditions::default()
    };
    let settings = RenderSettings {
        shading: kilauea_scene::Shading::Bytes,
        ..shot.settings.clone()
    };
    let job = RenderJob::start_under(conditions, Arc::new(prepared), settings)?;
    let stats = job.finish()?.stats.set.ok_or("no set")?;
    let met_share = |rays: &RayTraffic| rays.met as f64 / rays.asked.max(1) as f64;
    let shares = stats
        .rays
        .iter()
        .map(|rays| (rays.kind.clone(), met_share(rays)));
    let rays = stats.samples.iter().map(|sample| TracedRay {
        kind: sample.kind.clone(),
        boxes: sample.boxes.clone(),
    });
    Ok(RayTrace {
        rays: rays.collect(),
        box_bytes: stats.box_bytes.clone(),
        met_share: shares.collect(),
    })
}

impl Known {
    fn new(trace: RayTrace, whole: &Timed, two: &Timed) -> Outcome<Self> {
        let rays = whole.result.frame.stats.rays;
        let n_rays = (rays.camera + rays.indirect + rays.shadow) as f64;
        let secs_per_ray = working_secs(whole) / n_rays;
        let set = two.result.frame.stats.set.as_ref().ok_or("no set")?;
        let others = others_per_ray(two)?;
        let asked_of_others = others * total(set, |rays| rays.rays);
        let asking = trace.asking(2, false);
        let trace_secs = TRACING_SHARE * secs_per_ray;
        let shade_secs = secs_per_ray - trace_secs;
        let traced = 0.5 * asking.asked + others;
        let secs_of_two = 2.0 * working_secs(two) / n_rays;
        let question_secs = (secs_of_two - shade_secs - traced * trace_secs) / others;
        let met = asking.met / asking.asked * asked_of_others;
        let known = Self {
            trace,
            machine: Machine {
                shade_secs,
                question_secs,
                ..Machine::new(1e-6 / trace_secs, 0.0)
            },
            sizes: RaySizes {
                ray: total(set, |rays| rays.bytes_to_members) / asked_of_others,
                hit: total(set, |rays| rays.bytes_from_members) / met,
                ..RaySizes::default()
            },
            n_rays,
        };
        Ok(known)
    }

    /// Of a frame in which so many others are asked for a ray.
    fn seconds(&self, n_members: usize, n_others: f64, bytes_per_sec: f64) -> f64 {
        let n = n_members as f64;
        let whole_ray = self.trace.asking(n_members, false).asked * (1.0 - 1.0 / n);
        let machine = Machine {
            nic_bytes_per_sec: bytes_per_sec,
            ..self.machine
        };
        let model = SetModel {
            machines: vec![machine; n_members],
            sizes: self.sizes,
            batching: Batching {
                pool: POOL,
                ..Batching::default()
            },
            trace: &self.trace,
            is_full_broadcast: false,
            saved_by_own: (n * (1.0 - n_others / whole_ray)).max(0.0),
        };
        self.n_rays / model.run(1.0, 4.0).rays_per_sec()
    }
}

/// Members that are asked for a ray beside the one that asks. It asks itself each ray, and counts it.
fn others_per_ray(timed: &Timed) -> Outcome<f64> {
    let set = timed.result.frame.stats.set.as_ref().ok_or("no set")?;
    Ok(total(set, |rays| rays.asked) / total(set, |rays| rays.rays) - 1.0)
}

fn total(set: &SetStats, count: impl Fn(&RayTraffic) -> u64) -> f64 {
    set.rays.iter().map(count).sum::<u64>() as f64
}
