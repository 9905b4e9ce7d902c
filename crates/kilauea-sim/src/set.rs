//! The machines of one set, event by event.
//!
//! A machine keeps a pool of rays under way. Each is asked of members that the trace says, in batches
//! of one origin and one member; a batch leaves when it is full or old enough, passes the sender's
//! network card, the way, the receiver's card and its processor, and comes home by the same stations.
//! A ray is answered when all its batches are home, and another takes its place.

use std::collections::VecDeque;

use crate::events::Events;
use crate::machine::{Batching, Machine, RaySizes};
use crate::random::Random;
use crate::trace::{AskedRay, RayTrace};

/// A set, and what it is asked.
#[derive(Clone, Debug)]
pub struct SetModel<'a> {
    /// Its machines.
    pub machines: Vec<Machine>,
    /// What they send.
    pub sizes: RaySizes,
    /// How they send it.
    pub batching: Batching,
    /// What they trace.
    pub trace: &'a RayTrace,
    /// Whether all are asked about each ray.
    pub is_full_broadcast: bool,
    /// Who asks looks at its own part first. Of the questions to others, the share that this would save
    /// if its part were all of the scene; of a part, it saves as large a part.
    pub saved_by_own: f64,
}

/// What a set did while it was looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct SetOutcome {
    /// Seconds.
    pub seconds: f64,
    /// Rays answered, by who asked.
    pub answered: Vec<u64>,
    /// Rays traced for anyone, by who traced.
    pub traced: Vec<u64>,
    /// Share of the time in which processors were busy, by machine.
    pub busy: Vec<f64>,
    /// Bytes sent, by machine.
    pub bytes_sent: Vec<f64>,
    /// Bytes received, by machine.
    pub bytes_received: Vec<f64>,
    /// Rays asked from the start, and those answered until the end.
    pub asked_and_answered: [u64; 2],
    /// Rays under way at the end.
    pub under_way: u64,
    /// Mean number of rays in a batch.
    pub batch_rays: f64,
}

impl SetOutcome {
    /// Rays answered in a second, of all machines.
    pub fn rays_per_sec(&self) -> f64 {
        self.answered.iter().sum::<u64>() as f64 / self.seconds
    }
}

impl SetModel<'_> {
    /// Runs the set for `warm_up` seconds and then looks at it for `seconds`.
    pub fn run(&self, warm_up: f64, seconds: f64) -> SetOutcome {
        let asked = self
            .trace
            .asked(self.machines.len(), self.is_full_broadcast);
        let mut run = Run::new(self, &asked);
        run.until(warm_up);
        let before = run.counts.clone();
        run.until(warm_up + seconds);
        run.outcome(&before, seconds)
    }
}

/// Rays of one origin to one member.
#[derive(Debug)]
struct Batch {
    origin: usize,
    member: usize,
    rays: Vec<u32>,
    n_met: usize,
}

#[derive(Debug)]
enum Event {
    /// An open batch is old enough.
    Seal {
        origin: usize,
        member: usize,
        number: u64,
    },
    /// A batch has reached the receiver's card; or home, if it is a reply.
    Delivered { batch: Batch, is_reply: bool },
    /// It has passed that card.
    Received { batch: Batch, is_reply: bool },
    /// The member is done with it.
    Traced(Batch),
    /// A processor is done with what follows an answer.
    Shaded { origin: usize, n: usize },
}

/// A station that does one thing after the other.
#[derive(Clone, Copy, Debug, Default)]
struct Station {
    free_at: f64,
    busy_secs: f64,
}

impl Station {
    /// When something is done that comes now and takes so long.
    fn take(&mut self, now: f64, secs: f64) -> f64 {
        self.free_at = self.free_at.max(now) + secs;
        self.busy_secs += secs;
        self.free_at
    }
}

#[derive(Clone, Debug)]
struct Counts {
    answered: Vec<u64>,
    traced: Vec<u64>,
    busy_secs: Vec<f64>,
    bytes_sent: Vec<f64>,
    bytes_received: Vec<f64>,
    n_asked: u64,
    n_answered: u64,
    n_batches: u64,
    n_batched: u64,
}

#[derive(Default)]
struct Open {
    rays: Vec<u32>,
    /// How many batches there were before.
    number: u64,
}

/// A ray that waits for answers.
#[derive(Clone, Copy, Debug, Default)]
struct UnderWay {
    n_open: u16,
    met_share: f32,
}

struct Run<'a> {
    model: &'a SetModel<'a>,
    asked: &'a [AskedRay],
    events: Events<Event>,
    random: Random,
    /// By machine.
    processors: Vec<Station>,
    senders: Vec<Station>,
    receivers: Vec<Station>,
    /// By origin and member.
    open: Vec<Open>,
    /// By machine and ray.
    under_way: Vec<Vec<UnderWay>>,
    free: Vec<VecDeque<u32>>,
    counts: Counts,
}

impl<'a> Run<'a> {
    fn new(model: &'a SetModel<'a>, asked: &'a [AskedRay]) -> Self {
        let n = model.machines.len();
        let pool = model.batching.pool;
        let mut run = Self {
            model,
            asked,
            events: Events::new(),
            random: Random(3),
            processors: vec![Station::default(); n],
            senders: vec![Station::default(); n],
            receivers: vec![Station::default(); n],
            open: (0..n * n).map(|_| Open::default()).collect(),
            under_way: vec![vec![UnderWay::default(); pool]; n],
            free: vec![(0..pool as u32).collect(); n],
            counts: Counts {
                answered: vec![0; n],
                traced: vec![0; n],
                busy_secs: vec![0.0; n],
                bytes_sent: vec![0.0; n],
                bytes_received: vec![0.0; n],
                n_asked: 0,
                n_answered: 0,
                n_batches: 0,
                n_batched: 0,
            },
        };
        for origin in 0..n {
            // As if rays came from paths at different places: not all at once.
            let batch = model.batching.rays;
            for i in 0..pool.div_ceil(batch) {
                let n = batch.min(pool - i * batch);
                let secs = n as f64 / model.machines[origin].rays_per_sec;
                let time = (i + 1) as f64 * secs;
                run.events.at(time, Event::Shaded { origin, n });
            }
        }
        run
    }

    fn until(&mut self, end: f64) {
        while self.events.now < end {
            let Some(event) = self.events.next() else {
                break;
            };
            self.happen(event);
        }
    }

    fn happen(&mut self, event: Event) {
        let now = self.events.now;
        match event {
            Event::Shaded { origin, n } => (0..n).for_each(|_| self.ask(origin)),
            Event::Seal {
                origin,
                member,
                number,
            } => {
                if self.open[origin * self.n() + member].number == number {
                    self.seal(origin, member);
                }
            }
            Event::Delivered { batch, is_reply } => {
                let to = if is_reply { batch.origin } else { batch.member };
                let bytes = self.bytes(&batch, is_reply);
                self.counts.bytes_received[to] += bytes;
                let secs = bytes / self.model.machines[to].nic_bytes_per_sec;
                let done = self.receivers[to].take(now, secs);
                self.events.at(done, Event::Received { batch, is_reply });
            }
            Event::Received {
                batch,
                is_reply: false,
            } => self.trace(batch),
            Event::Received {
                batch,
                is_reply: true,
            } => self.come_home(&batch),
            Event::Traced(batch) => {
                if batch.origin == batch.member {
                    self.come_home(&batch);
                } else {
                    self.send(batch, true);
                }
            }
        }
    }

    /// Begins a ray.
    fn ask(&mut self, origin: usize) {
        let Some(slot) = self.free[origin].pop_front() else {
            return;
        };
        let ray = &self.asked[self.random.index(self.asked.len())];
        self.counts.n_asked += 1;
        self.under_way[origin][slot as usize] = UnderWay {
            n_open: ray.whom.len() as u16,
            met_share: ray.met_share as f32,
        };
        for &member in &ray.whom {
            let member = usize::from(member);
            if member != origin && self.is_saved() {
                self.under_way[origin][slot as usize].n_open -= 1;
                continue;
            }
            let at = origin * self.n() + member;
            self.open[at].rays.push(slot);
            let n_rays = self.open[at].rays.len();
            if n_rays >= self.model.batching.rays {
                self.seal(origin, member);
            } else if n_rays == 1 {
                let number = self.open[at].number;
                let time = self.events.now + self.model.batching.seal_secs;
                self.events.at(
                    time,
                    Event::Seal {
                        origin,
                        member,
                        number,
                    },
                );
            }
        }
        if self.under_way[origin][slot as usize].n_open == 0 {
            // Nobody need be asked.
            self.end(origin, slot);
            self.shade(origin, 1);
        }
    }

    /// Whether what somebody holds itself tells that another need not be asked.
    fn is_saved(&mut self) -> bool {
        let share = self.model.saved_by_own / self.n() as f64;
        share > 0.0 && self.random.unit() < share
    }

    fn seal(&mut self, origin: usize, member: usize) {
        let at = origin * self.n() + member;
        let open = &mut self.open[at];
        open.number += 1;
        let rays = std::mem::take(&mut open.rays);
        if rays.is_empty() {
            return;
        }
        self.counts.n_batches += 1;
        self.counts.n_batched += rays.len() as u64;
        let batch = Batch {
            origin,
            member,
            rays,
            n_met: 0,
        };
        if origin == member {
            self.trace(batch);
        } else {
            self.send(batch, false);
        }
    }

    fn send(&mut self, batch: Batch, is_reply: bool) {
        let from = if is_reply { batch.member } else { batch.origin };
        let bytes = self.bytes(&batch, is_reply);
        self.counts.bytes_sent[from] += bytes;
        let machine = &self.model.machines[from];
        let mut secs = machine.message_secs;
        if !is_reply {
            secs += 0.5 * machine.question_secs * batch.rays.len() as f64;
        }
        let made = self.processors[from].take(self.events.now, secs);
        let sent = self.senders[from].take(made, bytes / machine.nic_bytes_per_sec);
        let arrives = sent + 0.5 * self.model.batching.rtt_secs;
        self.events
            .at(arrives, Event::Delivered { batch, is_reply });
    }

    fn trace(&mut self, mut batch: Batch) {
        let member = batch.member;
        for &slot in &batch.rays {
            let share = self.under_way[batch.origin][slot as usize].met_share;
            batch.n_met += usize::from(self.random.unit() < f64::from(share));
        }
        self.counts.traced[member] += batch.rays.len() as u64;
        let machine = &self.model.machines[member];
        let mut secs = batch.rays.len() as f64 / machine.rays_per_sec;
        if batch.origin != member {
            secs += machine.message_secs;
            secs += 0.5 * machine.question_secs * batch.rays.len() as f64;
        }
        let done = self.processors[member].take(self.events.now, secs);
        self.events.at(done, Event::Traced(batch));
    }

    fn come_home(&mut self, batch: &Batch) {
        let origin = batch.origin;
        let mut n = 0;
        for &slot in &batch.rays {
            let n_open = &mut self.under_way[origin][slot as usize].n_open;
            *n_open -= 1;
            if *n_open == 0 {
                self.end(origin, slot);
                n += 1;
            }
        }
        if batch.member != origin {
            let secs = self.model.machines[origin].message_secs;
            self.processors[origin].take(self.events.now, secs);
        }
        if n > 0 {
            self.shade(origin, n);
        }
    }

    /// What follows the answers to some rays, and then as many new ones.
    fn shade(&mut self, origin: usize, n: usize) {
        /// So that time passes.
        const LEAST_SECS: f64 = 1e-9;
        let secs = n as f64 * self.model.machines[origin].shade_secs.max(LEAST_SECS);
        let done = self.processors[origin].take(self.events.now, secs);
        self.events.at(done, Event::Shaded { origin, n });
    }

    fn end(&mut self, origin: usize, slot: u32) {
        self.free[origin].push_back(slot);
        self.counts.answered[origin] += 1;
        self.counts.n_answered += 1;
    }

    fn bytes(&self, batch: &Batch, is_reply: bool) -> f64 {
        let sizes = &self.model.sizes;
        sizes.frame
            + if is_reply {
                batch.n_met as f64 * sizes.hit
            } else {
                batch.rays.len() as f64 * sizes.ray
            }
    }

    fn n(&self) -> usize {
        self.model.machines.len()
    }

    fn outcome(mut self, before: &Counts, seconds: f64) -> SetOutcome {
        let n_free: usize = self.free.iter().map(VecDeque::len).sum();
        let under_way = (self.n() * self.model.batching.pool - n_free) as u64;
        let stations = self.processors.iter().map(|station| station.busy_secs);
        self.counts.busy_secs = stations.collect();
        let counts = &self.counts;
        let since = |now: &[u64], then: &[u64]| now.iter().zip(then).map(|(a, b)| a - b).collect();
        let since_f64 = |now: &[f64], then: &[f64]| -> Vec<f64> {
            now.iter().zip(then).map(|(a, b)| a - b).collect()
        };
        let total = self.events.now.max(f64::MIN_POSITIVE);
        SetOutcome {
            seconds,
            answered: since(&counts.answered, &before.answered),
            traced: since(&counts.traced, &before.traced),
            busy: counts
                .busy_secs
                .iter()
                .map(|secs| (secs / total).min(1.0))
                .collect(),
            bytes_sent: since_f64(&counts.bytes_sent, &before.bytes_sent),
            bytes_received: since_f64(&counts.bytes_received, &before.bytes_received),
            asked_and_answered: [counts.n_asked, counts.n_answered],
            under_way,
            batch_rays: counts.n_batched as f64 / counts.n_batches.max(1) as f64,
        }
    }
}
