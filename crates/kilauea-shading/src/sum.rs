use std::pin::Pin;
use std::task::{Context, Poll, ready};

use kilauea_math::PackedSpectrum;

use crate::Scattered;

/// `async { direct.await + indirect.await }` in less memory: that would keep what it awaits in two
/// places, and light that is there beside them.
pub(crate) struct Sum<D, I> {
    direct: Summand<D>,
    indirect: I,
}

enum Summand<F> {
    OnItsWay(F),
    There(KeptLight),
}

/// [`Scattered`], packed.
struct KeptLight {
    diffuse: PackedSpectrum,
    specular: PackedSpectrum,
    path: PackedSpectrum,
}

impl<D, I> Sum<D, I> {
    pub(crate) fn new(direct: D, indirect: I) -> Self {
        Self {
            direct: Summand::OnItsWay(direct),
            indirect,
        }
    }
}

impl KeptLight {
    fn pack(light: Scattered) -> Self {
        Self {
            diffuse: light.diffuse.into(),
            specular: light.specular.into(),
            path: light.path.into(),
        }
    }

    fn unpack(&self) -> Scattered {
        Scattered {
            diffuse: self.diffuse.unpack(),
            specular: self.specular.unpack(),
            path: self.path.unpack(),
        }
    }
}

impl<D, I> Future for Sum<D, I>
where
    D: Future<Output = Scattered> + Unpin,
    I: Future<Output = Scattered> + Unpin,
{
    type Output = Scattered;

    #[inline(always)]
    fn poll(mut self: Pin<&mut Self>, task: &mut Context<'_>) -> Poll<Scattered> {
        let direct = match &mut self.direct {
            Summand::OnItsWay(direct) => ready!(Pin::new(direct).poll(task)),
            Summand::There(light) => light.unpack(),
        };
        let Poll::Ready(indirect) = Pin::new(&mut self.indirect).poll(task) else {
            self.direct = Summand::There(KeptLight::pack(direct));
            return Poll::Pending;
        };
        Poll::Ready(direct + indirect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::future::poll_fn;
    use std::pin::pin;
    use std::task::Waker;

    /// Light that is there once a flag is set, and cannot be asked for again.
    fn light(is_there: &Cell<bool>) -> impl Future<Output = Scattered> + Unpin {
        let mut is_taken = false;
        poll_fn(move |_| {
            assert!(!is_taken, "polled after it was ready");
            is_taken = is_there.get();
            if is_taken {
                Poll::Ready(Scattered::BY_PATH)
            } else {
                Poll::Pending
            }
        })
    }

    #[test]
    fn summands_arrive_in_any_order() {
        let mut task = Context::from_waker(Waker::noop());
        for direct_first in [true, false] {
            let (direct, indirect) = (Cell::new(direct_first), Cell::new(!direct_first));
            let mut sum = pin!(Sum::new(light(&direct), light(&indirect)));
            assert_eq!(sum.as_mut().poll(&mut task), Poll::Pending);
            assert_eq!(sum.as_mut().poll(&mut task), Poll::Pending);
            direct.set(true);
            indirect.set(true);
            let both = Scattered::BY_PATH + Scattered::BY_PATH;
            assert_eq!(sum.as_mut().poll(&mut task), Poll::Ready(both));
        }
    }
}
