//! The way in which nothing waits: questions are answered and children run inside the call.

use std::cell::Cell;
use std::future::{Ready, ready};
use std::marker::PhantomData;
use std::panic::resume_unwind;
use std::pin::pin;
use std::task::{self, Poll, Waker};

use crate::program::{Answerer, Context, Pool, Program, Runtime};

/// Runs SPOTs inside the call, children on the caller's stack.
///
/// It is [`Runtime`] and [`Context`] at once. Everything is known to the compiler, so what remains
/// of an `async fn` is a plain function.
pub struct Inline<'a, P, A> {
    program: &'a P,
    answerer: &'a A,
    /// The innermost SPOT whose code panicked.
    failed: &'a Cell<Option<&'a str>>,
}

/// Remembers nothing: a SPOT is over before [`Pool::start`] returns.
pub struct InlinePool<'a, F> {
    label: &'a str,
    failed: &'a Cell<Option<&'a str>>,
    future: PhantomData<F>,
}

/// The payload of the unwinding that ends a SPOT which awaits something foreign.
pub(crate) struct Stuck;

impl<'a, P: Program, A: Answerer<P>> Inline<'a, P, A> {
    pub(crate) fn new(program: &'a P, answerer: &'a A, failed: &'a Cell<Option<&'a str>>) -> Self {
        Self {
            program,
            answerer,
            failed,
        }
    }

    /// Does `work`.
    #[inline]
    pub(crate) fn run(self, work: P::Work) -> P::Output {
        self.program.starter(&self)(work, self)
    }
}

impl<P, A> Clone for Inline<'_, P, A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P, A> Copy for Inline<'_, P, A> {}

impl<P: Program, A: Answerer<P>> Context<P> for Inline<'_, P, A> {
    const WAITS: bool = false;

    type Reply = Ready<P::Answer>;
    type Child = Ready<P::Output>;

    #[inline]
    fn ask(&self, question: P::Question) -> Ready<P::Answer> {
        ready(self.answerer.answer(question))
    }

    fn spawn(&self, work: P::Work) -> Ready<P::Output> {
        ready(self.run(work))
    }
}

impl<'a, P: Program, A: Answerer<P>> Runtime<'a, P> for Inline<'a, P, A> {
    type Context = Self;
    type Started = P::Output;
    type Pool<F: Future<Output = P::Output> + 'a> = InlinePool<'a, F>;

    #[inline]
    fn pool<F: Future<Output = P::Output> + 'a>(&self, label: &'a str) -> InlinePool<'a, F> {
        InlinePool {
            label,
            failed: self.failed,
            future: PhantomData,
        }
    }
}

impl<F: Future> Pool<F> for InlinePool<'_, F> {
    type Started = F::Output;

    #[inline]
    fn start(&self, future: F) -> F::Output {
        let _blame = Blame {
            label: self.label,
            failed: self.failed,
        };
        let mut context = task::Context::from_waker(Waker::noop());
        match pin!(future).poll(&mut context) {
            Poll::Ready(output) => output,
            Poll::Pending => resume_unwind(Box::new(Stuck)),
        }
    }
}

/// Writes down a SPOT's label when its code unwinds. The innermost SPOT is first.
struct Blame<'a> {
    label: &'a str,
    failed: &'a Cell<Option<&'a str>>,
}

impl Drop for Blame<'_> {
    #[inline]
    fn drop(&mut self) {
        if std::thread::panicking() && self.failed.get().is_none() {
            self.failed.set(Some(self.label));
        }
    }
}
