"""Whether two noisy measurements differ: Welch's t-test, and Šidák's correction for many of them.

Everything works element by element on arrays, such as one element per tile and channel.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_TINY = 1e-300
_MAX_ITERATIONS = 10_000


def welch_t(
    mean_a: ArrayLike,
    var_a: ArrayLike,
    n_a: ArrayLike,
    mean_b: ArrayLike,
    var_b: ArrayLike,
    n_b: ArrayLike,
) -> tuple[Floats, Floats]:
    """Return Welch's t and its degrees of freedom (Welch 1947; Satterthwaite 1946).

    Parameters
    ----------
    mean_a, mean_b
        Means of the two samples; the shapes of all arguments broadcast.
    var_a, var_b
        Variances of single observations, with n - 1 in the denominator.
    n_a, n_b
        Observations in each sample, at least 2.

    Returns
    -------
    t, dof
        Where neither sample varies, t is 0 for equal means and infinite for different ones, and
        dof is n_a + n_b - 2.

    Raises
    ------
    ValueError
        A sample has fewer than two observations, which tell nothing about its variance.
    """
    counts = [np.asarray(n, np.float64) for n in (n_a, n_b)]
    if any((n < 2).any() for n in counts):
        raise ValueError("Welch's test needs at least two observations of each")
    squared_error_a = np.asarray(var_a, np.float64) / counts[0]
    squared_error_b = np.asarray(var_b, np.float64) / counts[1]
    squared_error = squared_error_a + squared_error_b
    difference = np.asarray(mean_a, np.float64) - np.asarray(mean_b, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(difference == 0.0, 0.0, difference / np.sqrt(squared_error))
        # Shares, not squares of the errors: those underflow in dark tiles.
        share_a = squared_error_a / squared_error
        dof = 1.0 / (share_a**2 / (counts[0] - 1.0) + (1.0 - share_a) ** 2 / (counts[1] - 1.0))
    return t, np.where(squared_error > 0.0, dof, counts[0] + counts[1] - 2.0)


def two_sided_p(t: ArrayLike, dof: ArrayLike) -> Floats:
    """Return the probability of a |t| at least as large, by Student's distribution.

    That is I_x(dof / 2, 1 / 2) at x = dof / (dof + t²) (Abramowitz and Stegun 26.7.1).
    NaN stays NaN.
    """
    t, dof = np.broadcast_arrays(np.asarray(t, np.float64), np.asarray(dof, np.float64))
    p = [_student_tail(value, freedom) for value, freedom in zip(t.flat, dof.flat, strict=True)]
    return np.array(p, np.float64).reshape(t.shape)


def sidak(alpha: float, tests: int) -> float:
    """Return the level of each of several independent tests that together have level `alpha`.

    Šidák 1967: 1 - (1 - alpha)^(1 / tests).
    """
    if tests < 1:
        raise ValueError(f"{tests} tests cannot share a level")
    return -math.expm1(math.log1p(-alpha) / tests)


def _student_tail(t: float, dof: float) -> float:
    if math.isnan(t) or math.isnan(dof):
        return math.nan
    if math.isinf(t):
        return 0.0
    return regularized_beta(dof / (dof + t * t), t * t / (dof + t * t), 0.5 * dof, 0.5)


def regularized_beta(x: float, complement: float, a: float, b: float) -> float:
    """Return the regularised incomplete beta function I_x(a, b).

    `complement` is 1 - x, which callers know without cancellation.
    """
    if x <= 0.0:
        return 0.0
    if complement <= 0.0:
        return 1.0
    # The fraction converges fast on one side of the mean of the distribution only.
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - regularized_beta(complement, x, b, a)
    log_beta = math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)
    front = math.exp(a * math.log(x) + b * math.log(complement) - log_beta) / a
    return front * _beta_fraction(x, a, b)


def _beta_fraction(x: float, a: float, b: float) -> float:
    """Evaluate the continued fraction DLMF 8.17.22 by Lentz's method (Thompson, Barnett 1986)."""
    numerator, denominator, value = 1.0, 0.0, 1.0
    for i in range(_MAX_ITERATIONS):
        m = i // 2
        if i == 0:
            term = 1.0
        elif i % 2 == 0:
            term = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        else:
            term = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        denominator = 1.0 / _away_from_zero(1.0 + term * denominator)
        numerator = _away_from_zero(1.0 + term / numerator)
        factor = numerator * denominator
        value *= factor
        if i > 0 and abs(factor - 1.0) < 1e-15:
            break
    # The first term is 1, so the loop ends at 1 + 1 / (1 + ...).
    return value - 1.0


def _away_from_zero(value: float) -> float:
    return value if abs(value) > _TINY else _TINY
