"""Curves of error against time, against power laws that are known."""

from __future__ import annotations

import pytest
from kilauea.benchmarks import convergence
from kilauea.benchmarks.summary import summarise

POWER_LAW = [(seconds, 3.0 / seconds**0.5) for seconds in (1.0, 4.0, 16.0)]


def test_slope_of_a_power_law() -> None:
    assert convergence.slope(POWER_LAW) == pytest.approx(-0.5)
    assert convergence.slope(POWER_LAW[:1]) is None
    assert convergence.slope([(1.0, 2.0), (1.0, 3.0)]) is None


def test_efficiency_needs_time_and_error() -> None:
    assert convergence.efficiency(2.0, 0.25) == pytest.approx(2.0)
    assert convergence.efficiency(2.0, 0.0) is None


@pytest.mark.parametrize("seconds", [1.0, 2.0, 9.0, 16.0])
def test_between_points_a_curve_is_straight(seconds: float) -> None:
    assert convergence.error_at(POWER_LAW, seconds) == pytest.approx(3.0 / seconds**0.5)
    assert convergence.time_to(POWER_LAW, 3.0 / seconds**0.5) == pytest.approx(seconds)


def test_beyond_its_points_a_curve_falls_as_unbiased_sampling_does() -> None:
    assert convergence.error_at(POWER_LAW, 0.5) == pytest.approx(6.0)
    assert convergence.error_at(POWER_LAW, 32.0) == pytest.approx(0.375)
    assert convergence.time_to(POWER_LAW, 6.0) == pytest.approx(0.5)
    assert convergence.time_to(POWER_LAW, 0.375) == pytest.approx(32.0)


def test_time_is_that_from_which_the_error_stays_below() -> None:
    """Of two crossings the later counts."""
    noisy = [(1.0, 1.0), (2.0, 0.2), (4.0, 0.8), (8.0, 0.1)]
    time = convergence.time_to(noisy, 0.3)
    assert time is not None
    assert 4.0 < time < 8.0


def test_nothing_follows_from_nothing() -> None:
    assert convergence.error_at([], 1.0) is None
    assert convergence.time_to([(1.0, 0.0)], 1.0) is None


def row(engine: str, target_s: float, seconds: float, error: float) -> dict:
    return {
        "stage": "box",
        "engine": engine,
        "samples_asked": round(4.0 * target_s),
        "samples_per_pixel": 4.0 * target_s,
        "seconds": seconds + 1.0,
        "load_s": 0.5,
        "build_s": 0.25,
        "render_s": seconds,
        "cpu_s": 2.0 * seconds,
        "relMSE": error + 0.125,
        "relMSE_of_reference": 0.125,
        "trimmed_relMSE": error,
        "MSE": error,
        "mean_FLIP": 0.1,
        "variance": error,
        "bias_squared": 0.0,
        "samples_per_s": 2e6,
        "rays_per_s": None,
        "peak_rss": 3_000_000,
        "reference": "agreed",
    }


def test_ratios_are_taken_at_equal_time() -> None:
    """An engine with half the error at each time, and another that lags behind its targets."""
    rows = [row("cycles", t, t, 1.0 / t) for t in (2.0, 8.0)]
    rows += [row("path", t, t, 0.5 / t) for t in (2.0, 8.0)]
    rows += [row("luxcore", t, 2.0 * t, 0.5 / t) for t in (2.0, 8.0)]
    found = {line["engine"]: line for line in summarise(rows)}
    assert found["cycles"]["ratio_render_s"] == pytest.approx(1.0)
    assert found["path"]["ratio_render_s"] == pytest.approx(0.5)
    assert found["path"]["ratio_cpu_s"] == pytest.approx(0.5)
    # Twice the time at half the error is the same curve.
    assert found["luxcore"]["ratio_render_s"] == pytest.approx(1.0)
    assert found["path"]["relMSE"] == pytest.approx(0.0625)
    assert found["path"]["slope"] == pytest.approx(-1.0)
    assert found["path"]["efficiency"] == pytest.approx(2.0)


def test_seeds_are_averaged_and_times_are_told_apart() -> None:
    rows = [row("cycles", 2.0, seconds, 0.5) for seconds in (1.0, 3.0)]
    rows += [row("cycles", 4.0, 4.0, 0.25)]
    (found,) = summarise(rows)
    assert found["slope"] == pytest.approx(-1.0)
    assert found["render_s"] == pytest.approx(4.0)


def test_without_the_baseline_there_is_no_ratio() -> None:
    (found,) = summarise([row("path", 2.0, 2.0, 0.5)])
    assert found["ratio_seconds"] is None
    assert found["time_ratio"] is None
