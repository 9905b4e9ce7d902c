//! A frame whose workers hold the whole scene, event by event: units are lent, rendered, and their
//! results sent back over links.
//!
//! The console is where all links meet. It lends each worker as many units as it has threads and one
//! more, so that a worker renders while its last result is on the way. Workers on one machine share
//! its cores.

use std::collections::VecDeque;

use crate::events::Events;

/// Workers and a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplicaModel {
    /// The link of each worker.
    pub links: Vec<ReplicaLink>,
    /// Engine threads of each.
    pub n_threads: usize,
    /// Cores that all of them share; infinite where each has its own.
    pub cores: f64,
    /// The frame, in the order in which it is lent.
    pub units: Vec<UnitCost>,
    /// Bytes that each worker gets before it can begin.
    pub scene_bytes: f64,
    /// Seconds of a core that it then takes to prepare.
    pub prepare_secs: f64,
    /// Round trips before the scene is sent: connecting, and the handshake.
    pub n_round_trips: f64,
}

/// The link between a worker and the console.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplicaLink {
    /// Bytes a second, each way; infinite if it never matters.
    pub bytes_per_sec: f64,
    /// Seconds that every byte is under way.
    pub delay_secs: f64,
}

/// What a unit costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitCost {
    /// Seconds of a core.
    pub secs: f64,
    /// Bytes of its result.
    pub result_bytes: f64,
}

/// What became of the frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplicaOutcome {
    /// Seconds until the last result was there.
    pub seconds: f64,
    /// Units done, by worker.
    pub units: Vec<u64>,
}

/// Work that a thread has begun.
struct Busy {
    worker: usize,
    /// The unit; none while the scene is prepared.
    unit: Option<usize>,
    /// Seconds of a core that are left.
    left_secs: f64,
}

enum Event {
    /// A worker has the scene.
    Scene { worker: usize },
    /// It has been lent a unit.
    Lease { worker: usize, unit: usize },
    /// Its console knows that it is ready.
    Ready { worker: usize },
    /// A result is there.
    Result { worker: usize },
}

/// A worker in a frame.
struct Worker {
    link: ReplicaLink,
    /// Lent and not begun.
    waiting: VecDeque<usize>,
    n_free_threads: usize,
    /// When its link has sent what was given to it.
    is_sent_at: f64,
    n_done: u64,
}

struct Run<'a> {
    model: &'a ReplicaModel,
    events: Events<Event>,
    workers: Vec<Worker>,
    busy: Vec<Busy>,
    n_lent: usize,
    n_done: usize,
}

impl ReplicaModel {
    /// Renders the frame.
    pub fn frame(&self) -> ReplicaOutcome {
        let worker = |&link: &ReplicaLink| Worker {
            link,
            waiting: VecDeque::new(),
            n_free_threads: 0,
            is_sent_at: 0.0,
            n_done: 0,
        };
        let mut run = Run {
            model: self,
            events: Events::new(),
            workers: self.links.iter().map(worker).collect(),
            busy: Vec::new(),
            n_lent: 0,
            n_done: 0,
        };
        for (worker, link) in self.links.iter().enumerate() {
            let greeted = 2.0 * link.delay_secs * self.n_round_trips;
            let sent = self.scene_bytes / link.bytes_per_sec;
            run.events
                .at(greeted + sent + link.delay_secs, Event::Scene { worker });
        }
        while run.n_done < self.units.len() && run.step() {}
        ReplicaOutcome {
            seconds: run.events.now,
            units: run.workers.iter().map(|worker| worker.n_done).collect(),
        }
    }
}

impl Run<'_> {
    /// Goes on to what happens next; false where nothing does any more.
    fn step(&mut self) -> bool {
        // Threads share the cores evenly (processor sharing).
        let speed = (self.model.cores / self.busy.len() as f64).min(1.0);
        let ends = |(i, busy): (usize, &Busy)| (self.events.now + busy.left_secs / speed, i);
        let first = self.busy.iter().enumerate().map(ends);
        let first = first.min_by(|a, b| a.0.total_cmp(&b.0));
        let begun = self.events.now;
        match (first, self.events.next_time()) {
            (Some((time, i)), next) if next.is_none_or(|next| time <= next) => {
                self.work((time - begun) * speed);
                self.events.now = time;
                self.end(i);
            }
            (_, Some(time)) => {
                self.work((time - begun) * speed);
                if let Some(event) = self.events.next() {
                    self.happen(&event);
                }
            }
            (_, None) => return false,
        }
        true
    }

    fn work(&mut self, secs: f64) {
        for busy in &mut self.busy {
            busy.left_secs -= secs;
        }
    }

    /// A thread has done what it began.
    fn end(&mut self, i: usize) {
        let Busy { worker, unit, .. } = self.busy.swap_remove(i);
        let state = &mut self.workers[worker];
        let delay_secs = state.link.delay_secs;
        if let Some(unit) = unit {
            state.n_free_threads += 1;
            let bytes = self.model.units[unit].result_bytes;
            let begin = state.is_sent_at.max(self.events.now);
            state.is_sent_at = begin + bytes / state.link.bytes_per_sec;
            self.events
                .at(state.is_sent_at + delay_secs, Event::Result { worker });
            self.begin(worker);
        } else {
            state.n_free_threads = self.model.n_threads;
            let arrives = self.events.now + delay_secs;
            self.events.at(arrives, Event::Ready { worker });
        }
    }

    fn happen(&mut self, event: &Event) {
        match *event {
            Event::Scene { worker } => self.busy.push(Busy {
                worker,
                unit: None,
                left_secs: self.model.prepare_secs,
            }),
            Event::Ready { worker } => (0..=self.model.n_threads).for_each(|_| self.lend(worker)),
            Event::Lease { worker, unit } => {
                self.workers[worker].waiting.push_back(unit);
                self.begin(worker);
            }
            Event::Result { worker } => {
                self.workers[worker].n_done += 1;
                self.n_done += 1;
                self.lend(worker);
            }
        }
    }

    /// Lends the next unit, if there is one.
    fn lend(&mut self, worker: usize) {
        if self.n_lent < self.model.units.len() {
            let unit = self.n_lent;
            self.n_lent += 1;
            // A lease is a few bytes.
            let arrives = self.events.now + self.workers[worker].link.delay_secs;
            self.events.at(arrives, Event::Lease { worker, unit });
        }
    }

    /// Gives a free thread a unit that waits.
    fn begin(&mut self, worker: usize) {
        let state = &mut self.workers[worker];
        if state.n_free_threads == 0 {
            return;
        }
        if let Some(unit) = state.waiting.pop_front() {
            state.n_free_threads -= 1;
            self.busy.push(Busy {
                worker,
                unit: Some(unit),
                left_secs: self.model.units[unit].secs,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INSTANT: ReplicaLink = ReplicaLink {
        bytes_per_sec: f64::INFINITY,
        delay_secs: 0.0,
    };

    /// 120 units of 10 ms and 1000 bytes.
    fn model(n_workers: usize, link: ReplicaLink) -> ReplicaModel {
        ReplicaModel {
            links: vec![link; n_workers],
            n_threads: 1,
            cores: f64::INFINITY,
            units: vec![
                UnitCost {
                    secs: 0.01,
                    result_bytes: 1000.0,
                };
                120
            ],
            scene_bytes: 0.0,
            prepare_secs: 0.0,
            n_round_trips: 0.0,
        }
    }

    fn check(model: &ReplicaModel, expected: f64) {
        let outcome = model.frame();
        assert_eq!(outcome.units.iter().sum::<u64>(), 120);
        assert!(
            (outcome.seconds - expected).abs() < 1e-9,
            "{outcome:?}, not {expected}"
        );
    }

    #[test]
    fn workers_share_the_work_and_cores_bound_it() {
        for n in [1, 2, 3, 8] {
            check(&model(n, INSTANT), 1.2 / n as f64);
            let mut crowded = model(n, INSTANT);
            crowded.cores = 2.0;
            check(&crowded, 1.2 / n.min(2) as f64);
            let mut threaded = model(1, INSTANT);
            threaded.n_threads = n;
            check(&threaded, 1.2 / n as f64);
        }
    }

    #[test]
    fn slow_links_bound_it() {
        // 20 ms to send a result: twice as long as to render it. The first waits for its rendering.
        let link = ReplicaLink {
            bytes_per_sec: 50e3,
            ..INSTANT
        };
        for n in [1, 2, 4] {
            check(&model(n, link), 0.01 + 0.02 * 120.0 / n as f64);
        }
    }

    #[test]
    fn one_unit_more_than_threads_hides_short_ways_only() {
        let with_delay = |delay_secs| ReplicaLink {
            delay_secs,
            ..INSTANT
        };
        // A unit goes there and back while the other is rendered. What shows are the ways of the scene,
        // of word that it is ready, of the first lease and of the last result.
        check(&model(1, with_delay(0.005)), 4.0 * 0.005 + 1.2);
        // Two units for each way there and back and a unit's time, in 60 rounds of which the last ends
        // with its second unit.
        check(&model(1, with_delay(0.05)), 4.0 * 0.05 + 59.0 * 0.11 + 0.02);
    }

    #[test]
    fn a_slow_link_takes_fewer_units() {
        let mut model = model(2, INSTANT);
        model.links[1].bytes_per_sec = 10e3;
        let outcome = model.frame();
        assert!(outcome.units[1] < outcome.units[0] / 5, "{outcome:?}");
    }

    #[test]
    fn what_comes_first_is_the_scene() {
        let link = ReplicaLink {
            bytes_per_sec: 1e6,
            delay_secs: 0.001,
        };
        let mut model = model(1, link);
        model.units.truncate(1);
        model.scene_bytes = 1e5;
        model.prepare_secs = 0.5;
        model.n_round_trips = 2.0;
        // Round trips, the scene, preparing, word of it, the lease, the unit, its result.
        let expected = 0.004 + 0.1 + 0.001 + 0.5 + 0.001 + 0.001 + 0.01 + 0.001 + 0.001;
        let outcome = model.frame();
        assert!((outcome.seconds - expected).abs() < 1e-9, "{outcome:?}");
    }
}
