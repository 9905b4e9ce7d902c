//! Where on a path light stopped being a number.
//!
//! Paths are traced without a look at their values. One whose light turns out to be NaN or infinite
//! is traced once more, under watch: it is the same path, as its numbers follow from its pixel and
//! sample.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use crate::geometry::PrimitiveRef;

/// What a path does, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) enum Step {
    /// The camera made a ray.
    CameraRay,
    /// A ray met something.
    Hit,
    /// A point, its normals and its place on the primitive.
    Surface,
    /// Light met by a ray, of a surface or a light.
    Emission,
    /// A shader made a BSDF.
    Bsdf,
    /// A light and a direction toward it were chosen.
    LightSample,
    /// The BSDF weighed that direction.
    BsdfValue,
    /// The BSDF chose a direction.
    BsdfSample,
    /// The product of all events so far.
    Throughput,
    /// Everything was added up: each part was finite.
    Sum,
    /// The sum met the exposure of the camera.
    Exposure,
}

/// Where a path broke. Surfaces have names where other processes read of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Fault<At = PrimitiveRef> {
    pub(crate) step: Step,
    /// Scattering events before it.
    pub(crate) depth: u32,
    /// The surface at which it happened, if at any.
    pub(crate) at: Option<At>,
}

/// Sees the values of a path.
pub(crate) trait Watch: Copy {
    /// `is_finite` is whether what `step` made after `depth` events is a number.
    fn see(
        self,
        step: Step,
        depth: u32,
        at: Option<PrimitiveRef>,
        is_finite: impl FnOnce() -> bool,
    );
}

/// Looks at nothing, at no cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unwatched;

impl Watch for Unwatched {
    #[inline(always)]
    fn see(self, _: Step, _: u32, _: Option<PrimitiveRef>, _: impl FnOnce() -> bool) {}
}

/// Keeps the first fault.
#[derive(Debug, Default)]
pub(crate) struct FirstFault(OnceLock<Fault>);

impl FirstFault {
    /// What was found.
    pub(crate) fn get(&self) -> Option<Fault> {
        self.0.get().copied()
    }

    /// By a call: integrators are many, and look in many places.
    #[cold]
    #[inline(never)]
    fn keep(&self, fault: Fault) {
        self.0.get_or_init(|| fault);
    }
}

impl Watch for &FirstFault {
    fn see(
        self,
        step: Step,
        depth: u32,
        at: Option<PrimitiveRef>,
        is_finite: impl FnOnce() -> bool,
    ) {
        if self.0.get().is_none() && !is_finite() {
            self.keep(Fault { step, depth, at });
        }
    }
}

/// The faults of many samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Faults<At = PrimitiveRef> {
    by_step: BTreeMap<Step, Found<At>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Found<At> {
    n_samples: u64,
    /// The topmost, then leftmost, then earliest sample: the same however threads share the work.
    first: (SampleId, Fault<At>),
}

impl<At> Default for Faults<At> {
    fn default() -> Self {
        Self {
            by_step: BTreeMap::new(),
        }
    }
}

/// A sample of a pixel; ordered by row, column and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct SampleId {
    pub(crate) row: i32,
    pub(crate) column: i32,
    pub(crate) sample: u32,
}

impl<At> Faults<At> {
    /// Counts a sample.
    pub(crate) fn add(&mut self, id: SampleId, fault: Fault<At>) {
        let first = (id, fault);
        self.add_found(Found {
            n_samples: 1,
            first,
        });
    }

    /// Counts the samples of others.
    pub(crate) fn merge(&mut self, others: Self) {
        for found in others.by_step.into_values() {
            self.add_found(found);
        }
    }

    fn add_found(&mut self, found: Found<At>) {
        match self.by_step.entry(found.first.1.step) {
            Entry::Vacant(entry) => {
                entry.insert(found);
            }
            Entry::Occupied(mut entry) => {
                let so_far = entry.get_mut();
                so_far.n_samples += found.n_samples;
                if found.first.0 < so_far.first.0 {
                    so_far.first = found.first;
                }
            }
        }
    }

    /// Samples by the step at which they broke; every step is named.
    pub(crate) fn counts(&self) -> BTreeMap<Cow<'static, str>, u64> {
        let count = |step| self.by_step.get(&step).map_or(0, |found| found.n_samples);
        Step::ALL
            .map(|step| (step.name().into(), count(step)))
            .into()
    }
}

impl Faults {
    /// The same with the names that `place` gives surfaces.
    pub(crate) fn named(&self, place: impl Fn(PrimitiveRef) -> String) -> Faults<String> {
        let named = |found: &Found<PrimitiveRef>| {
            let (id, Fault { step, depth, at }) = found.first;
            let at = at.map(&place);
            Found {
                n_samples: found.n_samples,
                first: (id, Fault { step, depth, at }),
            }
        };
        let by_step = &self.by_step;
        Faults {
            by_step: by_step
                .iter()
                .map(|(&k, found)| (k, named(found)))
                .collect(),
        }
    }
}

impl Faults<String> {
    /// A line for each step at which samples broke.
    pub(crate) fn lines(&self) -> Vec<String> {
        let line = |(step, found): (&Step, &Found<String>)| {
            let (id, fault) = &found.first;
            let SampleId {
                row,
                column,
                sample,
            } = id;
            let at = fault.at.as_ref();
            format!(
                "{} samples are black because their {} was not finite; the first in pixel \
                 ({column}, {row}), sample {sample}, after {} bounces{}",
                found.n_samples,
                step.words(),
                fault.depth,
                at.map_or_else(String::new, |at| format!(", on {at}")),
            )
        };
        self.by_step.iter().map(line).collect()
    }
}

impl Step {
    const ALL: [Self; 11] = [
        Self::CameraRay,
        Self::Hit,
        Self::Surface,
        Self::Emission,
        Self::Bsdf,
        Self::LightSample,
        Self::BsdfValue,
        Self::BsdfSample,
        Self::Throughput,
        Self::Sum,
        Self::Exposure,
    ];

    /// As a field of the statistics.
    fn name(self) -> &'static str {
        match self {
            Self::CameraRay => "camera_ray",
            Self::Hit => "hit",
            Self::Surface => "surface",
            Self::Emission => "emission",
            Self::Bsdf => "bsdf",
            Self::LightSample => "light_sample",
            Self::BsdfValue => "bsdf_value",
            Self::BsdfSample => "bsdf_sample",
            Self::Throughput => "throughput",
            Self::Sum => "sum",
            Self::Exposure => "exposure",
        }
    }

    fn words(self) -> String {
        self.name().replace('_', " ").replace("bsdf", "BSDF")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(row: i32, column: i32) -> SampleId {
        SampleId {
            row,
            column,
            sample: 3,
        }
    }

    fn fault(step: Step, depth: u32) -> Fault {
        Fault {
            step,
            depth,
            at: None,
        }
    }

    #[test]
    fn the_first_value_that_is_not_finite_is_kept() {
        let watch = FirstFault::default();
        (&watch).see(Step::CameraRay, 0, None, || true);
        assert_eq!(watch.get(), None);
        (&watch).see(Step::Bsdf, 1, None, || false);
        (&watch).see(Step::Sum, 2, None, || false);
        assert_eq!(watch.get(), Some(fault(Step::Bsdf, 1)));
    }

    #[test]
    fn faults_are_counted_by_step_and_the_topmost_is_named() {
        let mut faults = Faults::default();
        faults.add(id(5, 1), fault(Step::Emission, 7));
        faults.add(id(2, 9), fault(Step::Emission, 8));
        faults.add(id(2, 10), fault(Step::Emission, 9));
        faults.add(id(0, 0), fault(Step::BsdfSample, 1));
        let counts = faults.counts();
        assert_eq!(counts.len(), Step::ALL.len());
        assert_eq!((counts["emission"], counts["bsdf_sample"]), (3, 1));
        assert_eq!(counts["sum"], 0);
        let lines = faults
            .named(|_| unreachable!("no fault is at a surface"))
            .lines();
        assert_eq!(lines.len(), 2);
        assert!(lines[0].contains("3 samples") && lines[0].contains("pixel (9, 2), sample 3"));
        assert!(lines[0].contains("after 8 bounces"), "{}", lines[0]);
        assert!(lines[1].contains("BSDF sample"), "{}", lines[1]);
    }

    #[test]
    fn faults_of_others_add_up() {
        let mut all = Faults::default();
        let mut parts = [Faults::default(), Faults::default()];
        for (row, part) in [(4, 0), (1, 1), (7, 1), (2, 0)] {
            all.add(id(row, 0), fault(Step::Hit, row.cast_unsigned()));
            parts[part].add(id(row, 0), fault(Step::Hit, row.cast_unsigned()));
        }
        parts[1].add(id(0, 0), fault(Step::Sum, 1));
        all.add(id(0, 0), fault(Step::Sum, 1));
        let [mut first, second] = parts;
        first.merge(second);
        assert_eq!(first, all);
    }
}
