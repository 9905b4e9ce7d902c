"""Welch's test against published values, closed forms and itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from kilauea.statistics import regularized_beta, sidak, two_sided_p, welch_t


def test_welch_of_a_worked_example() -> None:
    """The yields of two varieties: t and degrees of freedom by the formulas, in fractions."""
    a, b = np.array([3.0, 5.0, 7.0, 9.0]), np.array([1.0, 2.0, 6.0])
    t, dof = welch_t(a.mean(), a.var(ddof=1), 4, b.mean(), b.var(ddof=1), 3)
    # Variances 20/3 and 7, so squared errors 5/3 and 7/3.
    assert t == pytest.approx(3.0 / math.sqrt(4.0))
    assert dof == pytest.approx(16.0 / ((25.0 / 9.0) / 3.0 + (49.0 / 9.0) / 2.0))


@pytest.mark.parametrize("n", [2, 5, 40])
def test_equal_samples_have_all_degrees_of_freedom(n: int) -> None:
    t, dof = welch_t(1.0, 0.25, n, 1.5, 0.25, n)
    assert dof == pytest.approx(2 * n - 2)
    assert t == pytest.approx(-0.5 / math.sqrt(0.5 / n))


def test_what_does_not_vary_differs_or_does_not() -> None:
    t, dof = welch_t([1.0, 1.0], 0.0, 4, [1.0, 2.0], 0.0, 4)
    np.testing.assert_array_equal(t, [0.0, -math.inf])
    np.testing.assert_array_equal(dof, [6.0, 6.0])
    np.testing.assert_array_equal(two_sided_p(t, dof), [1.0, 0.0])


def test_scale_does_not_matter() -> None:
    """Not even where the square of the variance is no float any more."""
    scale = 1e-90
    expected = welch_t(1.0, 2.0, 3, 1.5, 0.5, 7)
    found = welch_t(1.0 * scale, 2.0 * scale**2, 3, 1.5 * scale, 0.5 * scale**2, 7)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_one_observation_is_refused() -> None:
    with pytest.raises(ValueError, match="two observations"):
        welch_t(0.0, 1.0, 1, 0.0, 1.0, 5)


@pytest.mark.parametrize(
    ("dof", "t"),
    [(1, 12.7062047), (2, 4.30265273), (5, 2.57058184), (30, 2.04227246)],
)
def test_p_at_the_tabulated_quantiles(dof: float, t: float) -> None:
    """The 97.5 % quantiles of every table of Student's distribution."""
    assert two_sided_p([t, -t], dof) == pytest.approx([0.05, 0.05], rel=1e-7)


@pytest.mark.parametrize("t", [1e-6, 0.3, 1.0, 4.0, 300.0])
def test_p_where_the_distribution_is_elementary(t: float) -> None:
    """One degree of freedom is Cauchy's distribution; two have an algebraic one."""
    assert two_sided_p(t, 1) == pytest.approx(2.0 / math.pi * math.atan2(1.0, t), rel=1e-12)
    # 1 - t / sqrt(t² + 2), without its cancellation.
    root = math.sqrt(t * t + 2.0)
    assert two_sided_p(t, 2) == pytest.approx(2.0 / (root * (root + t)), rel=1e-12)


def test_p_is_normal_in_the_limit() -> None:
    for t in (0.5, 2.0, 5.0):
        assert two_sided_p(t, 1e9) == pytest.approx(math.erfc(t / math.sqrt(2.0)), rel=1e-6)


def test_p_keeps_shape_and_nan() -> None:
    p = two_sided_p(np.array([[0.0, math.nan, math.inf]]), 3.0)
    assert p.shape == (1, 3)
    np.testing.assert_array_equal(p, [[1.0, math.nan, 0.0]])


def test_beta_of_whole_numbers() -> None:
    """I_x(a, 1) = x^a, and I_x(2, 2) = 3 x² - 2 x³."""
    for x in (0.01, 0.3, 0.9):
        assert regularized_beta(x, 1.0 - x, 3.5, 1.0) == pytest.approx(x**3.5, rel=1e-12)
        expected = 3.0 * x**2 - 2.0 * x**3
        assert regularized_beta(x, 1.0 - x, 2.0, 2.0) == pytest.approx(expected, rel=1e-12)


def test_p_is_uniform_where_nothing_differs() -> None:
    """With unequal variances and counts: a tenth of the tests lies in each tenth."""
    generator = np.random.default_rng(7)
    a = generator.normal(3.0, 1.0, (20_000, 6))
    b = generator.normal(3.0, 2.5, (20_000, 9))
    t, dof = welch_t(
        a.mean(axis=1), a.var(axis=1, ddof=1), 6, b.mean(axis=1), b.var(axis=1, ddof=1), 9
    )
    share, _ = np.histogram(two_sided_p(t, dof), bins=10, range=(0.0, 1.0))
    np.testing.assert_allclose(share / 20_000, 0.1, atol=4.0 * math.sqrt(0.09 / 20_000))


def test_sidak() -> None:
    assert sidak(0.05, 1) == pytest.approx(0.05)
    assert (1.0 - sidak(0.05, 12)) ** 12 == pytest.approx(0.95)
    assert sidak(0.05, 10**9) == pytest.approx(-math.log(0.95) / 1e9)
    with pytest.raises(ValueError, match="0 tests"):
        sidak(0.05, 0)
