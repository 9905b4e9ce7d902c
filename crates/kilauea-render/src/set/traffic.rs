//! What a frame asked of the members of a set.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use kilauea_accel::Ray;
use kilauea_math::hash::combine;
use serde::{Deserialize, Serialize};

use super::MemberBytes;
use super::photons::PhotonParts;
use crate::prepared::PreparedScene;

/// What a ray is for. Rays of one kind travel together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RayKind {
    Camera,
    Indirect,
    Shadow,
    /// None is traced: photons are looked up.
    Photons,
}

impl RayKind {
    pub(crate) const ALL: [Self; 4] = [Self::Camera, Self::Indirect, Self::Shadow, Self::Photons];

    fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Indirect => "indirect",
            Self::Shadow => "shadow",
            Self::Photons => "photons",
        }
    }
}

/// Counters, by kind of ray and by member.
pub(crate) struct Traffic {
    kinds: [KindCounters; 4],
    /// By member, without who asks.
    asked: Vec<AtomicU64>,
    /// One ray in so many is sampled; none if zero.
    sample_one_in: u32,
    samples: Mutex<Vec<RaySample>>,
    /// Batches that other processes were asked, and the time until their answers.
    batches: AtomicU64,
    micros_under_way: AtomicU64,
}

/// Most rays that are sampled.
const MAX_SAMPLES: usize = 100_000;

/// A ray, and what it may meet.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RaySample {
    /// As in [`RayTraffic`].
    pub kind: String,
    /// Numbers of what is placed together and has boxes that the ray pierced.
    pub boxes: Vec<u32>,
}

/// Who asks is asked every ray, if it is a member, and is counted at the end.
#[derive(Default)]
struct KindCounters {
    rays: AtomicU64,
    asked: AtomicU64,
    met: AtomicU64,
    bytes_to_members: AtomicU64,
    bytes_from_members: AtomicU64,
}

/// A frame over a set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetStats {
    /// Rays asked in batches, by what they are for. None where threads ask one by one.
    pub rays: Vec<RayTraffic>,
    /// The members, in order.
    pub members: Vec<MemberStats>,
    /// Batches that members in other processes were asked.
    pub batches: u64,
    /// Seconds from when such a batch went out until its answers were there, for all of them: several
    /// are under way at once.
    pub seconds_under_way: f64,
    /// Some of the rays, where they were asked for: what sets of other sizes would be asked.
    pub samples: Vec<RaySample>,
    /// Bytes of what is placed together, where rays were sampled.
    pub box_bytes: Vec<u64>,
    /// Room for photons, where it is said how much memory members have. Known to who planned the set.
    pub photon_room: Option<PhotonRoom>,
}

/// Room for photons beside a part of a scene, in bytes: the same for all members.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PhotonRoom {
    /// What the fullest member has left.
    pub left: u64,
    /// What a member was to have left, by the number of paths that leave lights.
    pub planned: u64,
}

/// Rays of one kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RayTraffic {
    /// `camera`, `indirect`, `shadow`, or `photons` for look-ups of those.
    pub kind: String,
    /// Rays, or look-ups.
    pub rays: u64,
    /// Members asked, for all of them.
    pub asked: u64,
    /// Members who had met something, for all of them.
    pub met: u64,
    /// Sent to members; zero where no bytes are made, as in the next.
    pub bytes_to_members: u64,
    /// Received from members.
    pub bytes_from_members: u64,
}

/// A member of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MemberStats {
    /// What it holds.
    pub bytes: MemberBytes,
    /// Rays that it was asked, of those asked in batches.
    pub asked: u64,
    /// Photons of the largest pass that it kept, where they were divided.
    pub photons: u64,
    /// Bytes of their map.
    pub photon_bytes: u64,
}

impl Traffic {
    pub(crate) fn new(n_members: usize, sample_one_in: u32) -> Self {
        Self {
            sample_one_in,
            samples: Mutex::default(),
            batches: AtomicU64::new(0),
            micros_under_way: AtomicU64::new(0),
            kinds: Default::default(),
            asked: (0..n_members).map(|_| AtomicU64::new(0)).collect(),
        }
    }

    pub(super) fn count_ray(&self, kind: RayKind) {
        add(&self.kinds[kind as usize].rays, 1);
    }

    /// Notes rays that another member is asked.
    pub(super) fn count_asked(&self, kind: RayKind, member: usize, n_rays: usize) {
        add(&self.kinds[kind as usize].asked, n_rays as u64);
        add(&self.asked[member], n_rays as u64);
    }

    /// Whether a ray is one of the sample: decided by its direction, as rays come in any order.
    pub(super) fn wants_sample(&self, ray: &Ray) -> bool {
        let key = || combine(ray.dir.x.to_bits(), ray.dir.z.to_bits());
        self.sample_one_in > 0 && key().is_multiple_of(self.sample_one_in)
    }

    pub(super) fn add_sample(&self, kind: RayKind, boxes: Vec<u32>) {
        let mut samples = self.samples.lock().unwrap_or_else(PoisonError::into_inner);
        if samples.len() < MAX_SAMPLES {
            let kind = kind.name().to_owned();
            samples.push(RaySample { kind, boxes });
        }
    }

    pub(super) fn count_met(&self, kind: RayKind, n: usize) {
        add(&self.kinds[kind as usize].met, n as u64);
    }

    /// Notes a batch that another process has answered.
    pub(super) fn count_batch(&self, under_way: Duration) {
        add(&self.batches, 1);
        add(&self.micros_under_way, under_way.as_micros() as u64);
    }

    pub(super) fn count_bytes(&self, kind: RayKind, [to_member, from_member]: [usize; 2]) {
        let counters = &self.kinds[kind as usize];
        add(&counters.bytes_to_members, to_member as u64);
        add(&counters.bytes_from_members, from_member as u64);
    }

    /// All counts, with what the members hold; none where there is no set.
    pub(crate) fn stats(
        &self,
        prepared: &PreparedScene,
        photons: &PhotonParts,
    ) -> Option<SetStats> {
        let set = prepared.set.as_ref()?;
        let samples = self.samples.lock().unwrap_or_else(PoisonError::into_inner);
        let get = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let kinds = RayKind::ALL.into_iter().zip(&self.kinds);
        let rays = |counters: &KindCounters| get(&counters.rays);
        let asked_here = |n_rays: u64| if set.own.is_some() { n_rays } else { 0 };
        let all_here: u64 = self.kinds.iter().map(rays).map(asked_here).sum();
        let asked_of = |member: usize| if set.own == Some(member) { all_here } else { 0 };
        Some(SetStats {
            batches: get(&self.batches),
            seconds_under_way: get(&self.micros_under_way) as f64 / 1e6,
            rays: kinds
                .map(|(kind, counters)| RayTraffic {
                    kind: kind.name().to_owned(),
                    rays: rays(counters),
                    asked: get(&counters.asked) + asked_here(rays(counters)),
                    met: get(&counters.met),
                    bytes_to_members: get(&counters.bytes_to_members),
                    bytes_from_members: get(&counters.bytes_from_members),
                })
                .collect(),
            members: (prepared.member_bytes().into_iter())
                .zip(self.asked.iter().enumerate())
                .map(|(bytes, (member, asked))| {
                    let held = photons.largest(member);
                    MemberStats {
                        bytes,
                        asked: get(asked) + asked_of(member),
                        photons: held.photons,
                        photon_bytes: held.bytes,
                    }
                })
                .collect(),
            box_bytes: if samples.is_empty() {
                Vec::new()
            } else {
                set.boxes.unit_bytes().to_vec()
            },
            samples: samples.clone(),
            photon_room: None,
        })
    }
}

impl SetStats {
    /// Adds what another member of the same set, or of one like it, asked in the same frame. What a
    /// member holds is known to itself alone.
    pub fn add(&mut self, other: &Self) {
        self.batches += other.batches;
        self.seconds_under_way += other.seconds_under_way;
        for (ours, theirs) in self.rays.iter_mut().zip(&other.rays) {
            ours.rays += theirs.rays;
            ours.asked += theirs.asked;
            ours.met += theirs.met;
            ours.bytes_to_members += theirs.bytes_to_members;
            ours.bytes_from_members += theirs.bytes_from_members;
        }
        for (ours, theirs) in self.members.iter_mut().zip(&other.members) {
            ours.asked += theirs.asked;
            if ours.bytes == MemberBytes::default() {
                ours.bytes = theirs.bytes;
            }
            ours.photons = ours.photons.max(theirs.photons);
            ours.photon_bytes = ours.photon_bytes.max(theirs.photon_bytes);
        }
    }
}

fn add(counter: &AtomicU64, n: u64) {
    counter.fetch_add(n, Ordering::Relaxed);
}
