//! Numbered paths as SPOTs of the dataflow engine: how they are shared out, and put in order again.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use kilauea_scene::Shading;
use kilauea_spot::{
    Bytes, Context, Engine, Job, Pool, Program, Queue, RunError, Runtime, Server, Split,
};

use crate::integrator::{Answer, Question, RayTracer};
use crate::set::{Asker, SetParts, Traffic};

/// Follows paths that depend on nothing but their number.
pub(crate) trait Follow: Sync {
    /// What paths leave behind, one after the other.
    type Left: Default + Send;

    /// Follows the path with that number.
    fn follow<P, C>(&self, number: u32, left: &mut Self::Left, cx: &C) -> impl Future<Output = ()>
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>;
}

/// Paths that are followed together where none of them waits.
pub(crate) const PATHS_PER_BLOCK: u32 = 256;

/// On how many threads paths are followed, and how their questions are answered: neither changes
/// what they leave.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Workforce {
    pub(crate) n_threads: usize,
    pub(crate) shading: Shading,
}

impl Workforce {
    /// Threads that answer their own questions.
    pub(crate) fn inline(n_threads: usize) -> Self {
        Self {
            n_threads,
            shading: Shading::Inline,
        }
    }
}

/// Follows paths by their numbers. What they leave is in the order of those, some paths together.
pub(crate) fn follow_some<F: Follow, const CUTOUTS: bool>(
    follower: &F,
    paths: Range<u32>,
    answerer: &RayTracer<'_, CUTOUTS>,
    workforce: Workforce,
) -> Result<Vec<F::Left>, RunError> {
    let Workforce { n_threads, shading } = workforce;
    let far = answerer.set.filter(Asker::is_far);
    // One answer a round trip would take for ever.
    let shading = match (shading, far) {
        (Shading::Inline, Some(_)) => Shading::Queued,
        (shading, _) => shading,
    };
    let job = PathsJob::<F> {
        paths,
        per_root: match shading {
            Shading::Inline => PATHS_PER_BLOCK,
            // While one path waits, others go on.
            Shading::Queued | Shading::Bytes => 1,
        },
        left: Mutex::default(),
    };
    let engine = Engine::new(n_threads);
    let program = FollowProgram(follower);
    let run =
        |server: &dyn Server<_>, n_servers| engine.run_queued(&program, server, n_servers, &job);
    match (shading, far) {
        (Shading::Inline, _) => engine.run_inline(&program, answerer, &job),
        (_, Some(asker)) => {
            // What these rays ask is not told apart.
            let traffic = &Traffic::new(asker.n_members(), 0);
            let blame = answerer.blame;
            let parts = SetParts::<CUTOUTS>::by_values(asker, blame, traffic);
            run(&Split::new(&parts), 1)
        }
        (Shading::Queued, None) => run(&Queue::new(answerer), n_threads),
        (Shading::Bytes, None) => run(&Bytes::new(answerer), n_threads),
    }?;
    Ok(job
        .left
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner))
}

/// A SPOT follows some paths, one after the other.
struct FollowProgram<'f, F>(&'f F);

/// All paths, cut into roots.
struct PathsJob<F: Follow> {
    paths: Range<u32>,
    per_root: u32,
    /// By root, as they end.
    left: Mutex<Vec<F::Left>>,
}

impl<F: Follow> FollowProgram<'_, F> {
    async fn follow_some<C: Context<Self>>(&self, numbers: Range<u32>, cx: C) -> F::Left {
        let mut left = F::Left::default();
        for number in numbers {
            self.0.follow(number, &mut left, &cx).await;
        }
        left
    }
}

impl<F: Follow> Program for FollowProgram<'_, F> {
    type Work = Range<u32>;
    type Output = F::Left;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(Range<u32>, R::Context) -> R::Started {
        let paths = runtime.pool("paths");
        move |numbers, cx| paths.start(self.follow_some(numbers, cx))
    }
}

impl<F: Follow> Job<FollowProgram<'_, F>> for PathsJob<F> {
    fn root(&self, number: u64) -> Option<Range<u32>> {
        let before = number.checked_mul(u64::from(self.per_root))?;
        let first = u64::from(self.paths.start).checked_add(before)?;
        let first = u32::try_from(first).ok().filter(|&n| n < self.paths.end)?;
        let end = first.saturating_add(self.per_root).min(self.paths.end);
        Some(first..end)
    }

    fn done(&self, number: u64, output: F::Left) {
        let mut left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        let idx = number as usize;
        if left.len() <= idx {
            left.resize_with(idx + 1, F::Left::default);
        }
        left[idx] = output;
    }
}
