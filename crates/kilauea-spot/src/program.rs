//! What a program of SPOTs consists of, and what its code sees of the engine.

/// The code of all SPOTs of a run, and the types that travel between them.
///
/// A SPOT is started from a `Work`, a plain description, and ends with an `Output`. On the way it
/// asks questions, which are answered by whoever holds the data, and spawns children, which are
/// works whose outputs it awaits.
pub trait Program: Sync + Sized {
    /// Describes a SPOT that has not started. Small: children wait in this form.
    type Work: Send;
    /// What a SPOT ends with.
    type Output: Send;
    /// What a SPOT may ask.
    type Question: Send + Clone;
    /// What it gets back.
    type Answer: Send;

    /// Makes what starts SPOTs on one thread: takes a pool for each type of future from `runtime`
    /// and returns a function that chooses code by work.
    ///
    /// Futures must await nothing but what their context hands out.
    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(Self::Work, R::Context) -> R::Started;
}

/// What the code of a SPOT sees of the engine.
///
/// Both calls send at once, not when their future is first polled: ask first, await later.
/// Dropping a future unread gives its slot back; a child goes on to its end all the same.
pub trait Context<P: Program>: Clone {
    /// Whether what it hands out may be pending when it is awaited. Where not, code may hold locks
    /// meanwhile.
    const WAITS: bool;

    /// Resolves to the answer. It may be awaited where it is, through `&mut`: a SPOT's future keeps
    /// what is moved to be awaited in two places.
    type Reply: Future<Output = P::Answer> + Unpin;
    /// Resolves to the output of the child.
    type Child: Future<Output = P::Output>;

    /// Asks a question.
    fn ask(&self, question: P::Question) -> Self::Reply;

    /// Has `work` done by a SPOT of the next generation.
    fn spawn(&self, work: P::Work) -> Self::Child;
}

/// One way of running SPOTs. Implemented by this crate alone; programs are generic over it.
pub trait Runtime<'a, P: Program> {
    /// What code of SPOTs sees.
    type Context: Context<P> + 'a;
    /// A SPOT that a pool has taken over.
    type Started;
    /// Memory for SPOTs whose future is `F`.
    type Pool<F: Future<Output = P::Output> + 'a>: Pool<F, Started = Self::Started>;

    /// A new pool; `F` follows from what is started in it. `label` names its SPOTs in errors.
    fn pool<F: Future<Output = P::Output> + 'a>(&self, label: &'a str) -> Self::Pool<F>;
}

/// Recycled memory for SPOTs of one type.
pub trait Pool<F> {
    /// A SPOT that the pool has taken over.
    type Started;

    /// Takes over a future.
    fn start(&self, future: F) -> Self::Started;
}

/// Answers questions, each by itself: the same question has the same answer, whoever asks first.
pub trait Answerer<P: Program>: Sync {
    /// The answer.
    fn answer(&self, question: P::Question) -> P::Answer;

    /// Whether the answer takes so long, as it comes from a disk, that others should not wait for
    /// it.
    fn is_slow(&self, _question: &P::Question) -> bool {
        false
    }
}

/// What a run is to compute: numbered roots, each a work of generation 0.
pub trait Job<P: Program>: Sync {
    /// The root with that number, or `None` if it and all that follow do not exist. Each number is
    /// asked for once, on any thread.
    fn root(&self, number: u64) -> Option<P::Work>;

    /// Whether a root may be asked for now. Where not, threads go on with what is under way and look
    /// again soon, so it must be cheap. Where it is so for one thread, another may be faster.
    fn has_root(&self) -> bool {
        true
    }

    /// Takes the output of a root. Called in any order, on any thread: results must be put in
    /// order by `number`.
    fn done(&self, number: u64, output: P::Output);

    /// Whether the run should end early. Called between SPOTs, so it must be cheap.
    fn is_cancelled(&self) -> bool {
        false
    }
}
