"""The split of errors and the agreement of engines, on images whose statistics are known."""

from __future__ import annotations

import dataclasses

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
from kilauea.benchmarks.reference import find_references, pairs, weighted
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


def sparks(seed: int, n: int, is_found: bool = False) -> Pixels:
    """Return tiles of a floor under light that paths meet by chance, once in a while."""
    renders = noisy(seed, n, 0.01)
    if is_found:
        for render in renders:
            render[32:, :32] += 0.5
    return tiles(renders)


def test_two_that_have_missed_the_same_light_agree_until_another_finds_it() -> None:
    a, b, finds = sparks(1, 4), sparks(2, 4), sparks(3, 4, is_found=True)
    assert compare_engines(("a", "b"), a, b).agrees
    found = compare_engines(("a", "b"), a, b, {"finds": finds, "like a": sparks(4, 4)})
    assert found.n_rejected == 0
    assert found.missed_by_both == {"finds": 3, "like a": 0}
    assert not found.agrees
    # One that has found it is enough, if the other may have.
    assert compare_engines(("a", "finds"), finds, finds, {"finds": finds}).agrees


def test_what_merging_moves_is_no_light_that_was_missed() -> None:
    a, b, merges = sparks(1, 4), sparks(2, 4), sparks(3, 4)
    merges[:, 1, 1] *= 1.08
    assert compare_engines(("a", "b"), a, b, {"merges": merges}).agrees


def test_tiles_of_rare_bright_samples_are_said_to_tell_nothing() -> None:
    a, b = sparks(1, 4), sparks(2, 4)
    assert compare_engines(("a", "b"), a, b).n_undecided == 0
    # One render in four has met it.
    a[0, 1, 0] += 100.0
    found = compare_engines(("a", "b"), a, b)
    assert found.n_rejected == 0
    assert found.n_undecided == 3


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
    assert pairs(["cycles", "cycles-guided"]) == []
    assert pairs(["luxcore", "luxcore-bidirvm"]) == []
    merging = ["path", "luxcore-bidirvm", "kilauea-consistent", "cycles"]
    confirmed = [("cycles", "luxcore-bidirvm"), ("path", "luxcore-bidirvm")]
    assert pairs(merging) == [("cycles", "path"), *confirmed]


def test_two_others_that_agree_are_the_reference() -> None:
    images = {"cycles": image("cycles", 1), "mitsuba": image("mitsuba", 2)}
    found = find_references(["path", "cycles", "mitsuba"], images.__getitem__)
    assert found.agreed_by == ("cycles", "mitsuba")
    expected = 0.5 * (images["cycles"].mean + images["mitsuba"].mean)
    np.testing.assert_allclose(found.of("path").mean, expected, atol=0.02)
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


def test_a_reference_is_not_trusted_where_a_witness_finds_more() -> None:
    images = {
        "cycles": image("cycles", 1),
        "path": image("path", 2),
        "luxcore-bidirvm": image("luxcore-bidirvm", 3, offset=0.5),
    }
    found = find_references(list(images), images.__getitem__)
    assert found.agreed is None
    test = found.tests[0]
    assert test.n_rejected == 0
    assert test.missed_by_both["luxcore-bidirvm"] > 0


@pytest.mark.parametrize(("blur", "is_confirmed"), [(0.03, True), (0.5, False)])
def test_an_engine_that_merges_is_believed_to_within_what_merging_moves(
    blur: float, is_confirmed: bool
) -> None:
    images = {
        "cycles": image("cycles", 1, offset=-0.5),
        "path": image("path", 2),
        "luxcore-bidirvm": image("luxcore-bidirvm", 3, offset=blur),
    }
    found = find_references(list(images), images.__getitem__)
    if is_confirmed:
        assert found.agreed_by == ("path", "luxcore-bidirvm")
        expected = 0.5 * (images["path"].mean + images["luxcore-bidirvm"].mean)
        np.testing.assert_allclose(found.of("cycles").mean, expected, atol=0.02)
    else:
        assert found.agreed is None


def test_the_less_noisy_image_weighs_more() -> None:
    clean, rough = image("cycles", 1), image("mitsuba", 2)
    rough = dataclasses.replace(
        rough,
        mean=1.0 + 3.0 * (rough.mean - 1.0),
        variance_of_mean=9.0 * rough.variance_of_mean,
    )
    found = weighted([clean, rough])
    np.testing.assert_allclose(found.mean, 0.9 * clean.mean + 0.1 * rough.mean, atol=0.05)
    assert found.variance_of_mean.mean() == pytest.approx(0.9 * 0.09 / 6.0, rel=0.05)
