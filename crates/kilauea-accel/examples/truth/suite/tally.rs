use super::oracle::{BORDER, ClearHit, Oracle};
use super::rays::{Aimed, Must};
use kilauea_accel::{Hit, Ray};

/// What went wrong, counted.
#[derive(Default)]
pub(crate) struct Tally {
    pub(crate) n_rays: u64,
    /// Those of `n_rays` that left a surface.
    pub(crate) n_spawned: u64,
    /// Rays that left a closed mesh between its triangles, or passed it by.
    pub(crate) n_leaks: u64,
    /// Rays that went through the middle of a triangle.
    pub(crate) n_missed: u64,
    /// Hits of triangles that the line clearly passes by, or outside the range.
    pub(crate) n_false: u64,
    /// Hits of the later of two equal triangles.
    pub(crate) n_wrong: u64,
    /// Rays that met the triangle that they left.
    pub(crate) n_self: u64,
    /// Rays of which the two kernels say different things.
    pub(crate) n_kernels: u64,
    /// Largest error of a distance, relative to it.
    pub(crate) max_t_error: f64,
    /// Furthest that a hit was off its triangle, in units in the last place of its distance.
    pub(crate) max_off_by: f64,
    /// One ray for each kind of failure.
    pub(crate) failures: Vec<String>,
}

/// Distances may be off by this fraction.
pub(crate) const MAX_T_ERROR: f64 = 1e-6;

impl Tally {
    /// Counts a ray of which the kernels do not say the same.
    pub(crate) fn kernels_differ(&mut self, ray: &Ray, found: Option<Hit>, happened: bool) {
        self.n_kernels += u64::from(happened);
        self.note(
            happened && self.n_kernels == 1,
            "kernels differ",
            ray,
            found,
        );
    }

    /// Counts a ray that met the triangle it left.
    pub(crate) fn self_hit(&mut self, ray: &Ray, found: Option<Hit>, happened: bool) {
        self.n_self += u64::from(happened);
        self.note(happened && self.n_self == 1, "self-hit", ray, found);
    }

    /// Compares a hit with the truth.
    pub(crate) fn judge(
        &mut self,
        oracle: &Oracle,
        aimed: &Aimed,
        nearest: Option<ClearHit>,
        found: Option<Hit>,
    ) {
        let ray = &aimed.ray;
        let t_found = found.map_or(f64::INFINITY, |hit| f64::from(hit.t));

        let leaks = match aimed.must {
            Must::Hit(by) => found.is_none() || t_found > by * (1.0 + MAX_T_ERROR),
            Must::Miss | Must::Either => false,
        };
        self.n_leaks += u64::from(leaks);
        self.note(leaks && self.n_leaks == 1, "leak", ray, found);

        let missed = nearest.is_some_and(|clear| clear.t < t_found * (1.0 - MAX_T_ERROR));
        self.n_missed += u64::from(missed);
        self.note(missed && self.n_missed == 1, "miss", ray, found);

        let Some(hit) = found else { return };
        let truth = oracle.reported(ray, &hit);
        let out_of_range = hit.t <= ray.t_min.max(0.0) || hit.t > ray.t_max;
        let is_false = truth.off_by > BORDER || out_of_range || aimed.must == Must::Miss;
        self.n_false += u64::from(is_false);
        self.note(is_false && self.n_false == 1, "false hit", ray, found);
        self.max_off_by = self.max_off_by.max(truth.off_by);

        let [t_least, t_most] = truth.t_range;
        let t_exact = if truth.is_inside {
            truth.t
        } else {
            // On the border a kernel keeps to the triangle, whatever the plane says.
            t_found.clamp(t_least, t_most)
        };
        let error = (t_found - t_exact).abs() - truth.uncertain_t;
        let t_error = error.max(0.0) / t_exact.abs();
        if t_error > self.max_t_error {
            self.max_t_error = t_error;
            let exceeds = t_error > MAX_T_ERROR;
            self.note(exceeds, &format!("t is {t_exact:e}"), ray, found);
        }

        let is_wrong = nearest.is_some_and(|clear| {
            clear.instance == hit.instance
                && clear.triangle < hit.primitive
                && oracle.is_same_place(hit.instance, clear.triangle, hit.primitive)
        });
        self.n_wrong += u64::from(is_wrong);
        self.note(is_wrong && self.n_wrong == 1, "later of equals", ray, found);
    }

    /// Whether anything is not as it must be.
    pub(crate) fn is_clean(&self) -> bool {
        self.n_leaks + self.n_missed + self.n_false + self.n_wrong + self.n_self + self.n_kernels
            == 0
            && self.max_t_error <= MAX_T_ERROR
    }

    fn note(&mut self, is_first: bool, what: &str, ray: &Ray, found: Option<Hit>) {
        if is_first {
            self.failures.push(format!("{what}: {ray:?} {found:?}"));
        }
    }
}
