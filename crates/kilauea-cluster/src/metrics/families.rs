//! Every metric that there is. docs/metrics.md lists them too; a test compares.

use super::board::View;
use super::text::{Kind, Sample, write_family};
use crate::handshake::build_hash;
use crate::snapshot::{WorkerState, WorkerView};

/// A metric: its name by the conventions of Prometheus (base units, `_total` for counters).
struct Family {
    name: &'static str,
    kind: Kind,
    help: &'static str,
    samples: fn(&View) -> Vec<Sample>,
}

/// The page that a server gets.
pub(super) fn page(view: &View) -> String {
    let mut page = String::new();
    for family in FAMILIES {
        let Family {
            name,
            kind,
            help,
            samples,
        } = family;
        write_family(&mut page, (name, *kind, help), &samples(view));
    }
    page
}

const fn counter(name: &'static str, help: &'static str, samples: Samples) -> Family {
    family(name, Kind::Counter, help, samples)
}

const fn gauge(name: &'static str, help: &'static str, samples: Samples) -> Family {
    family(name, Kind::Gauge, help, samples)
}

type Samples = fn(&View) -> Vec<Sample>;

const fn family(name: &'static str, kind: Kind, help: &'static str, samples: Samples) -> Family {
    Family {
        name,
        kind,
        help,
        samples,
    }
}

const FAMILIES: &[Family] = &[
    gauge(
        "kilauea_build_info",
        "Always 1; the build of Kilauea.",
        |_| {
            vec![Sample {
                labels: vec![("hash", format!("{:016x}", build_hash()))],
                value: 1.0,
            }]
        },
    ),
    counter("kilauea_frames_begun_total", "Frames begun.", |view| {
        one(view.n_frames)
    }),
    gauge(
        "kilauea_frame_done_ratio",
        "Samples of the frame that are here, of all that it will have.",
        |view| one_f64(view.now.fraction_done),
    ),
    gauge("kilauea_frame_passes", "Passes of the frame.", |view| {
        one(view.now.n_passes)
    }),
    gauge(
        "kilauea_frame_passes_done",
        "Passes that all tiles of the frame are through.",
        |view| one(view.now.n_passes_over),
    ),
    gauge("kilauea_frame_units", "Units of the frame.", |view| {
        one_f64(view.now.units.n_units as f64)
    }),
    gauge(
        "kilauea_units_leased",
        "Units that workers hold, twice where two hold one.",
        |view| one_f64(view.now.units.n_held as f64),
    ),
    counter(
        "kilauea_units_lent_total",
        "Times that units were lent.",
        |view| one(view.totals.n_lent),
    ),
    counter(
        "kilauea_units_reissued_total",
        "Times that units were lent that had been lent before.",
        |view| one(view.totals.n_lent_again),
    ),
    counter(
        "kilauea_units_done_total",
        "Units whose results count.",
        |view| one(view.totals.n_done),
    ),
    counter(
        "kilauea_units_late_total",
        "Results that came too late to count.",
        |view| one(view.totals.n_late_results),
    ),
    counter(
        "kilauea_network_sent_bytes_total",
        "Bytes sent to workers, headers included.",
        |view| one(view.totals.bytes_sent),
    ),
    counter(
        "kilauea_network_received_bytes_total",
        "Bytes received from workers, headers included.",
        |view| one(view.totals.bytes_received),
    ),
    counter(
        "kilauea_network_frames_total",
        "Frames of bytes, either way.",
        |view| one(view.totals.messages),
    ),
    counter(
        "kilauea_network_stale_frames_total",
        "Frames of workers that were dead already, which were dropped.",
        |view| one(view.totals.stale_messages),
    ),
    gauge(
        "kilauea_workers",
        "Workers that are there, by state.",
        |view| {
            let sample = |state: WorkerState| {
                let workers = view.now.workers.iter();
                Sample {
                    labels: vec![("state", state.name().into())],
                    value: workers.filter(|worker| worker.state == state).count() as f64,
                }
            };
            WorkerState::ALL.into_iter().map(sample).collect()
        },
    ),
    counter(
        "kilauea_workers_started_total",
        "Lives of workers begun: for each frame, and again where one was lost.",
        |view| one(view.totals.n_started),
    ),
    counter("kilauea_workers_lost_total", "Workers lost.", |view| {
        one(view.totals.n_lost)
    }),
    counter(
        "kilauea_worker_units_done_total",
        "Units whose results count, by worker.",
        |view| by_rank(view, 0),
    ),
    counter(
        "kilauea_worker_rays_total",
        "Rays traced for them, by worker.",
        |view| by_rank(view, 1),
    ),
    gauge(
        "kilauea_worker_units_leased",
        "Units that a worker holds.",
        |view| by_worker(view, |worker| worker.n_held.into()),
    ),
    gauge(
        "kilauea_worker_frames_waiting",
        "Frames of bytes that wait to be sent to a worker.",
        |view| by_worker(view, |worker| worker.n_frames_waiting as f64),
    ),
    gauge(
        "kilauea_worker_silence_seconds",
        "Time since a worker last said anything; it does every 250 ms.",
        |view| by_worker(view, |worker| worker.silence_secs),
    ),
    gauge(
        "kilauea_worker_epoch",
        "The life that a worker is in; another one each time that one is started.",
        |view| by_worker(view, |worker| worker.epoch.into()),
    ),
    gauge(
        "kilauea_worker_threads",
        "Engine threads of a worker.",
        |view| by_worker(view, |worker| worker.stats.threads.into()),
    ),
    gauge(
        "kilauea_worker_peak_resident_bytes",
        "Highest resident size of a worker's process.",
        |view| by_worker(view, |worker| worker.stats.peak_rss as f64),
    ),
    gauge(
        "kilauea_console_peak_resident_bytes",
        "Highest resident size of the console's process.",
        |view| one_f64(view.now.peak_rss as f64),
    ),
];

fn one(count: impl Into<u64>) -> Vec<Sample> {
    let count: u64 = count.into();
    one_f64(count as f64)
}

fn one_f64(value: f64) -> Vec<Sample> {
    let labels = Vec::new();
    vec![Sample { labels, value }]
}

fn by_worker(view: &View, value: fn(&WorkerView) -> f64) -> Vec<Sample> {
    let sample = |worker: &WorkerView| Sample {
        labels: vec![("worker", worker.stats.rank.to_string())],
        value: value(worker),
    };
    view.now.workers.iter().map(sample).collect()
}

fn by_rank(view: &View, which: usize) -> Vec<Sample> {
    let sample = |(rank, counts): (&u32, &[u64; 2])| Sample {
        labels: vec![("worker", rank.to_string())],
        value: counts[which] as f64,
    };
    view.totals.by_rank.iter().map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_the_conventions() {
        let mut names: Vec<&str> = FAMILIES.iter().map(|family| family.name).collect();
        for family in FAMILIES {
            let Family { name, kind, .. } = family;
            let is_plain = |c: char| c.is_ascii_lowercase() || c == '_';
            assert!(
                name.starts_with("kilauea_") && name.chars().all(is_plain),
                "{name}"
            );
            assert_eq!(name.ends_with("_total"), *kind == Kind::Counter, "{name}");
        }
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), FAMILIES.len());
    }

    #[test]
    fn the_page_of_the_documentation_lists_them_all() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/metrics.md");
        let page = std::fs::read_to_string(path).unwrap();
        let listed: Vec<&str> = (page.lines())
            .filter_map(|line| line.strip_prefix("| `kilauea_"))
            .collect();
        assert_eq!(listed.len(), FAMILIES.len());
        for (line, family) in listed.iter().zip(FAMILIES) {
            let kind = format!("{:?}", family.kind).to_lowercase();
            let name = &family.name["kilauea_".len()..];
            let row = format!("{name}` | {kind} | ");
            assert!(line.starts_with(&row), "{line} where {row} should be");
        }
    }

    #[test]
    fn a_page_without_a_frame_is_a_page() {
        let page = page(&View::default());
        assert!(page.contains("kilauea_frames_begun_total 0\n"), "{page}");
        assert!(
            page.contains("kilauea_workers{state=\"suspect\"} 0\n"),
            "{page}"
        );
        assert!(!page.contains("kilauea_worker_epoch"), "nobody is there");
    }
}
