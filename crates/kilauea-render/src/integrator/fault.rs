//! Where on a path light stopped being a number.
//!
//! Paths are traced without a look at their values. One whose light turns out to be NaN or infinite
//! is traced once more, under watch: it is the same path, as its numbers follow from its pixel and
//! sample.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use crate::geometry::PrimitiveRef;

/// What a path does, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
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

/// Where a path broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub(crate) step: Step,
    /// Scattering events before it.
    pub(crate) depth: u32,
    /// The surface at which it happened, if at any.
    pub(crate) at: Option<PrimitiveRef>,
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
            self.0.get_or_init(|| Fault { step, depth, at });
        }
    }
}

/// The faults of a frame.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    by_step: BTreeMap<Step, Found>,
}

#[derive(Debug)]
struct Found {
    n_samples: u64,
    /// The topmost, then leftmost, then earliest sample: the same however threads share the work.
    first: (SampleId, Fault),
}

/// A sample of a pixel; ordered by row, column and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SampleId {
    pub(crate) row: i32,
    pub(crate) column: i32,
    pub(crate) sample: u32,
}

impl Faults {
    /// Counts a sample.
    pub(crate) fn add(&mut self, id: SampleId, fault: Fault) {
        let found = self.by_step.entry(fault.step).or_insert(Found {
            n_samples: 0,
            first: (id, fault),
        });
        found.n_samples += 1;
        if id < found.first.0 {
            found.first = (id, fault);
        }
    }

    /// Samples by the step at which they broke; every step is named.
    pub(crate) fn counts(&self) -> BTreeMap<&'static str, u64> {
        let count = |step| self.by_step.get(&step).map_or(0, |found| found.n_samples);
        Step::ALL.map(|step| (step.name(), count(step))).into()
    }

    /// A line for each step at which samples broke. `place` names a surface.
    pub(crate) fn lines(&self, place: impl Fn(PrimitiveRef) -> String) -> Vec<String> {
        let line = |(step, found): (&Step, &Found)| {
            let (id, fault) = found.first;
            let SampleId {
                row,
                column,
                sample,
            } = id;
            let at = fault.at.map_or_else(String::new, &place);
            format!(
                "{} samples are black because their {} was not finite; the first in pixel \
                 ({column}, {row}), sample {sample}, after {} bounces{at}",
                found.n_samples,
                step.words(),
                fault.depth,
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
        let lines = faults.lines(|_| unreachable!("no fault is at a surface"));
        assert_eq!(lines.len(), 2);
        assert!(lines[0].contains("3 samples") && lines[0].contains("pixel (9, 2), sample 3"));
        assert!(lines[0].contains("after 8 bounces"), "{}", lines[0]);
        assert!(lines[1].contains("BSDF sample"), "{}", lines[1]);
    }
}
