//! Rays of a render: whose boxes each of them pierced.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::law::Asking;
use crate::random::Random;

/// Rays of a frame, or a sample of them, as `kilauea bench sets --trace` writes them.
#[derive(Clone, Debug, Deserialize)]
pub struct RayTrace {
    /// In the order in which they were asked.
    pub rays: Vec<TracedRay>,
    /// Bytes of what is in each box.
    pub box_bytes: Vec<u64>,
    /// Of the members asked for a ray of a kind, the share that had met something.
    pub met_share: BTreeMap<String, f64>,
}

/// A ray.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct TracedRay {
    /// `camera`, `indirect` or `shadow`.
    pub kind: String,
    /// Boxes that it pierced, by number.
    pub boxes: Vec<u32>,
}

/// A trace that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// Not what is expected.
    #[error("a trace of rays cannot be read: {0}")]
    Json(#[from] serde_json::Error),
    /// A ray pierces a box that there is not.
    #[error("ray {ray} pierces box {number} of {n_boxes}")]
    Box {
        /// Number of the ray.
        ray: usize,
        /// Of the box.
        number: u32,
        /// Boxes there are.
        n_boxes: usize,
    },
    /// Nothing to simulate.
    #[error("a trace has no rays")]
    Empty,
}

/// A ray as a set of some size sees it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AskedRay {
    /// Members, by number.
    pub(crate) whom: Vec<u16>,
    /// Share of them that answer with a hit.
    pub(crate) met_share: f64,
}

impl RayTrace {
    /// Reads and checks a trace.
    ///
    /// # Errors
    /// If it is none, or has no rays.
    pub fn from_json(json: &str) -> Result<Self, TraceError> {
        let trace: Self = serde_json::from_str(json)?;
        let n_boxes = trace.box_bytes.len();
        for (ray, traced) in trace.rays.iter().enumerate() {
            if let Some(&number) = traced.boxes.iter().find(|&&b| b as usize >= n_boxes) {
                return Err(TraceError::Box {
                    ray,
                    number,
                    n_boxes,
                });
            }
        }
        if trace.rays.is_empty() {
            return Err(TraceError::Empty);
        }
        Ok(trace)
    }

    /// Rays that each pierce so many boxes by chance, of as many bytes each; of members asked, a
    /// share has met something.
    pub fn by_chance(n_rays: usize, n_boxes: u32, pierced: usize, met_share: f64) -> Self {
        let mut random = Random(7);
        let ray = |_| TracedRay {
            kind: "indirect".to_owned(),
            boxes: (0..pierced)
                .map(|_| random.index(n_boxes as usize) as u32)
                .collect(),
        };
        Self {
            rays: (0..n_rays).map(ray).collect(),
            box_bytes: vec![1; n_boxes as usize],
            met_share: BTreeMap::from([("indirect".to_owned(), met_share)]),
        }
    }

    /// Gives boxes to the members of a set at random and evenly by bytes, and says who is asked
    /// about each ray; all are if `is_full`.
    pub(crate) fn asked(&self, n_members: usize, is_full: bool) -> Vec<AskedRay> {
        let owners = self.owners(n_members);
        let asked = |ray: &TracedRay| {
            let mut whom: Vec<u16> = if is_full {
                (0..n_members as u16).collect()
            } else {
                ray.boxes.iter().map(|&b| owners[b as usize]).collect()
            };
            whom.sort_unstable();
            whom.dedup();
            // Who is asked about more boxes than before does not answer more often.
            let n_met = self.met_share.get(&ray.kind).copied().unwrap_or(0.0);
            AskedRay {
                met_share: n_met,
                whom,
            }
        };
        self.rays.iter().map(asked).collect()
    }

    /// How the scene asks a set of that size.
    pub fn asking(&self, n_members: usize, is_full: bool) -> Asking {
        let rays = self.asked(n_members, is_full);
        let mut by_member = vec![0.0_f64; n_members];
        let mut met = 0.0;
        for ray in &rays {
            ray.whom.iter().for_each(|&m| by_member[m as usize] += 1.0);
            met += ray.met_share * ray.whom.len() as f64;
        }
        let total: f64 = by_member.iter().sum();
        let most = by_member.iter().copied().fold(0.0, f64::max);
        Asking {
            n_members,
            asked: total / rays.len() as f64,
            met: met / rays.len() as f64,
            imbalance: most * n_members as f64 / total.max(1.0),
        }
    }

    /// The owner of each box: the member that has least, in an order by chance, large ones first.
    fn owners(&self, n_members: usize) -> Vec<u16> {
        let mut random = Random(11);
        let mut order: Vec<(u32, u64, usize)> = (self.box_bytes.iter().enumerate())
            .map(|(i, &bytes)| (u32::MAX - bytes.max(1).ilog2(), random.next(), i))
            .collect();
        order.sort_unstable();
        let mut bytes = vec![0_u64; n_members];
        let mut owners = vec![0; self.box_bytes.len()];
        for (_, _, i) in order {
            let least = (0..n_members).min_by_key(|&m| bytes[m]).unwrap_or(0);
            bytes[least] += self.box_bytes[i];
            owners[i] = least as u16;
        }
        owners
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traces_are_checked() {
        let read = |json: &str| RayTrace::from_json(json).map(|t| t.rays.len());
        let trace = r#"{"rays": [{"kind": "shadow", "boxes": [0, 1]}], "box_bytes": [5, 6],
            "met_share": {"shadow": 0.5}}"#;
        assert_eq!(read(trace).unwrap(), 1);
        let outside = trace.replace("[0, 1]", "[2]");
        assert!(
            read(&outside)
                .unwrap_err()
                .to_string()
                .contains("box 2 of 2")
        );
        let empty = r#"{"rays": [], "box_bytes": [], "met_share": {}}"#;
        assert!(matches!(read(empty), Err(TraceError::Empty)));
        assert!(matches!(read("{"), Err(TraceError::Json(_))));
    }

    #[test]
    fn boxes_go_to_members_evenly() {
        let trace = RayTrace::by_chance(10, 640, 1, 0.5);
        let owners = trace.owners(5);
        for member in 0..5 {
            assert_eq!(owners.iter().filter(|&&o| o == member).count(), 128);
        }
    }

    /// Of `m` members, a ray that pierces `b` boxes of random owners asks m (1 - (1 - 1/m)^b).
    #[test]
    fn members_asked_by_boxes_pierced() {
        let trace = RayTrace::by_chance(20_000, 5000, 6, 0.25);
        for m in [1_usize, 2, 8, 100] {
            let expected = m as f64 * (1.0 - (1.0 - 1.0 / m as f64).powi(6));
            let asking = trace.asking(m, false);
            assert!((asking.asked / expected - 1.0).abs() < 0.02, "{asking:?}");
            assert!((asking.met / asking.asked - 0.25).abs() < 1e-9);
            assert!(asking.imbalance < 1.2, "{asking:?}");
            assert_eq!(trace.asking(m, true).asked, m as f64);
        }
    }
}
