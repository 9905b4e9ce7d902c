"""The split of errors and the agreement of engines, on images whose statistics are known."""

from __future__ import annotations

import numpy as np
import pytest
from kilauea.benchmarks.agreement import compare_engines, tile_means
from kilauea.benchmarks.converged import Converged
from kilauea.benchmarks.image_error import (
    Moments,
    Pixels,
    read_pixels,
    relative_weight,
    split,
    write_pixels,
)
from kilauea.benchmarks.reference import find_references, pairs
from kilauea.errors import KilaueaError

SHAPE = (64, 96, 3)


def noisy(seed: int, n: int, deviation: float = 0.3, offset: float = 0.0) -> list[Pixels]:
    generator = np.random.default_rng(seed)
    return [generator.normal(1.0 + offset, deviation, SHAPE) for _ in range(n)]


@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_variance_and_bias_come_apart(offset: float) -> None:
    """The reference is noisy too, which must not count as bias."""
    # Bright, so that the weight does not depend on the noise.
    level = 100.0
    reference = Moments.of([level + render for render in noisy(1, 4, 0.5)])
    renders = [level + render for render in noisy(2, 3, 0.3, offset)]
    found = split(renders, reference.mean, reference.variance_of_mean)
    weight = 1.0 / (level + 1.0) ** 2
    assert found.variance == pytest.approx(weight * 0.09, rel=0.03)
    # The reference alone adds 0.0625 to the squared distance, the renders' mean 0.03.
    assert found.bias_squared == pytest.approx(weight * offset**2, abs=weight * 0.006)


def test_variance_and_bias_add_up_to_the_error() -> None:
    renders = noisy(3, 4, 0.3, 0.1)
    reference = np.ones(SHAPE)
    parts = split(renders, reference, np.zeros(SHAPE))
    weight = relative_weight(reference)
    errors = [(weight * (render - reference) ** 2).mean() for render in renders]
    assert parts.variance + parts.bias_squared == pytest.approx(np.mean(errors), rel=1e-12)


def test_one_render_has_no_variance() -> None:
    with pytest.raises(ValueError, match="one render"):
        Moments.of(noisy(1, 1))


def test_pixels_survive_the_file(tmp_path) -> None:
    pixels = noisy(1, 1)[0]
    write_pixels(tmp_path / "image.exr", pixels)
    np.testing.assert_array_equal(read_pixels(tmp_path / "image.exr"), np.float32(pixels))
    with pytest.raises(KilaueaError, match="absent"):
        read_pixels(tmp_path / "absent.exr")


def test_tiles_at_the_borders_are_smaller() -> None:
    pixels = np.zeros((5, 7, 1))
    pixels[4, 6] = 3.0
    pixels[:4, :4] = 2.0
    means = tile_means(pixels, tile=4)
    np.testing.assert_allclose(means[..., 0], [[2.0, 0.0], [0.0, 1.0]])


def tiles(renders: list[Pixels]) -> Pixels:
    return np.stack([tile_means(render) for render in renders])


def test_equal_engines_agree_and_a_tint_is_found() -> None:
    a, b = tiles(noisy(1, 8)), tiles(noisy(2, 8))
    same = compare_engines(("a", "b"), a, b)
    assert same.agrees
    assert same.n_tests == 2 * 3 * 3
    tinted = b.copy()
    # A twentieth in one channel of one tile, where the standard error is half a percent.
    tinted[:, 1, 2, 0] *= 1.05
    found = compare_engines(("a", "b"), a, tinted)
    assert found.n_rejected == 1
    assert not found.agrees


def test_agreement_has_the_level_that_it_says() -> None:
    """Of many pairs of equal engines, about a tenth disagree at a level of a tenth."""
    generator = np.random.default_rng(5)
    draws = generator.normal(1.0, 0.1, (200, 2, 8, 2, 1, 3))
    wrong = sum(not compare_engines(("a", "b"), a, b, level=0.1).agrees for a, b in draws)
    assert 8 <= wrong <= 34


def image(engine: str, seed: int, offset: float = 0.0) -> Converged:
    renders = noisy(seed, 6, offset=offset)
    moments = Moments.of(renders)
    return Converged(
        engine, "1.0", 6.0, 1.0, moments.mean, moments.variance_of_mean, tiles(renders)
    )


def test_our_engines_never_decide_alone() -> None:
    assert pairs(["kilauea", "path"]) == []
    assert pairs(["kilauea-consistent", "cycles"]) == []
    assert pairs(["kilauea", "path", "cycles"]) == [("cycles", "kilauea"), ("cycles", "path")]
    assert pairs(["path", "cycles", "mitsuba"])[0] == ("cycles", "mitsuba")
    assert ("cycles", "cycles-guided") not in pairs(["cycles", "cycles-guided"])


def test_two_others_that_agree_are_the_reference() -> None:
    images = {"cycles": image("cycles", 1), "mitsuba": image("mitsuba", 2)}
    found = find_references(["path", "cycles", "mitsuba"], images.__getitem__)
    assert found.agreed_by == ("cycles", "mitsuba")
    expected = 0.5 * (images["cycles"].mean + images["mitsuba"].mean)
    np.testing.assert_allclose(found.of("path").mean, expected)
    # Half the variance of either.
    assert found.of("path").variance_of_mean.mean() == pytest.approx(0.09 / 12.0, rel=0.05)
    assert found.record()["kind"] == "agreed"


def test_where_none_agree_each_has_its_own() -> None:
    images = {"cycles": image("cycles", 1), "path": image("path", 2, offset=0.5)}
    found = find_references(["path", "cycles"], images.__getitem__)
    assert found.agreed is None
    assert found.record()["kind"] == "own"
    np.testing.assert_array_equal(found.of("path").mean, images["path"].mean)
    (test,) = found.tests
    assert test.mean_ratio == pytest.approx((1.0 / 1.5,) * 3, rel=0.02)
