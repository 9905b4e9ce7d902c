"""The tests behind `kilauea check`, on images whose differences and noise are known."""

from __future__ import annotations

import math

import numpy as np
import OpenImageIO as oiio
import pytest

pytest.importorskip("kilauea._native")

from kilauea.checking.bias import compare_means, scale_of
from kilauea.checking.compare import compare_light, compare_shape
from kilauea.checking.criteria import Criteria, parse_criteria
from kilauea.checking.errors import CannotCheckError
from kilauea.checking.images import Batches, Measured, StoredImage
from kilauea.checking.judge import Verdict, judge, verdict_of
from kilauea.checking.noise import measure_noise
from kilauea.checking.plan import Budget, round_up, samples_wanted
from kilauea.checking.run import run_check
from kilauea.checking.shift import measure_shift
from kilauea.checking.stored import read_reference, write_reference
from kilauea.checking.tiles import tile_means
from kilauea.errors import UsageError

HEIGHT, WIDTH, N_BATCHES = 40, 56, 16
NOISE = 0.4
"""Standard deviation of a sample."""


def scene(shift_right: float = 0.0, shift_down: float = 0.0) -> np.ndarray:
    """Smooth discs on a slope, so that a displacement by parts of a pixel is exact."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    x, y = x - shift_right, y - shift_down
    light = 0.4 + 0.006 * x + 0.004 * y
    for cx, cy, radius in ((18.0, 14.0, 9.0), (40.0, 25.0, 11.0)):
        light = light + 0.8 / (1.0 + np.exp(np.hypot(x - cx, y - cy) - radius))
    return light[:, :, None] * np.array([1.0, 0.8, 0.5])


class Painter:
    """Renders an image with independent noise, as an engine with random samples would."""

    def __init__(self, truth: np.ndarray, stream: int, noise: float = NOISE) -> None:
        self.truth = truth
        self.stream = stream
        self.noise = noise

    def render(self, samples_per_batch: int, n: int, first_seed: int) -> Batches:
        rng = np.random.default_rng([self.stream, first_seed, samples_per_batch])
        sigma = self.noise / math.sqrt(samples_per_batch)
        images = self.truth + rng.normal(0.0, sigma, (n, *self.truth.shape))
        luminance = np.array([0.212671, 0.71516, 0.072169])
        claimed = np.full(self.truth.shape[:2], sigma**2 * (luminance**2).sum(), np.float32)
        return Batches("painter", images.astype(np.float32), samples_per_batch, claimed)


def stored(batches: Batches) -> StoredImage:
    return StoredImage("stored", batches.mean, batches.pixel_variance, 1, batches.n)


def check(ours: Painter, reference: Painter, *thresholds: str, samples: int = 64):
    budget = Budget(N_BATCHES, samples // 4 * N_BATCHES, samples * N_BATCHES, is_fixed=True)
    return run_check(ours, reference, parse_criteria(thresholds), budget)


def failed(outcome) -> set[str]:
    return {f.name for f in outcome.findings if f.verdict is Verdict.FAIL}


def test_equal_engines_pass() -> None:
    outcome = check(Painter(scene(), 1), Painter(scene(), 2), "image=0", "tile=0", "shift=0")
    assert outcome.verdict is Verdict.PASS, [f.summary for f in outcome.findings]
    assert outcome.rounds == [256, 1024]


def test_p_values_are_uniform_where_engines_agree() -> None:
    p = []
    for stream in range(10):
        batches = [Painter(scene(), 2 * stream + i).render(4, N_BATCHES, 1) for i in (0, 1)]
        p.append(compare_light(*batches, 8, Criteria()).tiles.p.ravel())
    p = np.sort(np.concatenate(p))
    # Kolmogorov's bound for a level of 0.001.
    distance = np.abs(p - (np.arange(p.size) + 0.5) / p.size).max()
    assert distance < 1.95 / math.sqrt(p.size)


def test_false_alarms_are_as_rare_as_promised() -> None:
    """At the margin itself, one group in twenty is found at a significance of 5 %."""
    rng = np.random.default_rng(5)
    alarms = 0
    for _ in range(400):
        values = rng.normal(1.02, 0.01, (N_BATCHES, 6))
        reference = rng.normal(1.0, 0.01, (N_BATCHES, 6))
        measured = [
            Measured(v.mean(axis=0), v.var(axis=0, ddof=1) / N_BATCHES, N_BATCHES)
            for v in (values, reference)
        ]
        alarms += compare_means(*measured, 1.0, 0.02, 0.05, 0.9).is_significant.any()
    # Binomial with p = 0.05: more than 36 or fewer than 7 come up once in some thousand runs.
    assert 7 <= alarms <= 36


def test_the_detectable_bias_is_found_as_often_as_promised() -> None:
    rng = np.random.default_rng(6)
    spread = 0.02

    def compare(bias: float, rng: np.random.Generator):
        values = rng.normal([[1.0 + bias], [1.0]], spread, (N_BATCHES, 2, 1))
        measured = [
            Measured(v.mean(axis=0), v.var(axis=0, ddof=1) / N_BATCHES, N_BATCHES)
            for v in (values[:, 0], values[:, 1])
        ]
        return compare_means(*measured, 1.0, 0.01, 0.01, 0.9)

    error = spread * math.sqrt(2.0 / N_BATCHES)
    detectable = 0.01 + error * compare(0.0, rng).errors_needed.item()
    n_found = sum(compare(detectable, rng).is_significant.all() for _ in range(400))
    # The sum of quantiles is close to, and no more than, what the noncentral distribution takes.
    assert 0.85 < n_found / 400 < 0.95


@pytest.mark.parametrize(
    ("ours", "thresholds", "expected"),
    [
        (1.01 * scene(), (), {"image"}),
        (1.005 * scene(), ("image=0.1%",), {"image"}),
        (scene(shift_right=0.5), (), {"shift"}),
        (scene(shift_down=-0.1), (), {"shift"}),
    ],
    ids=["light-1-percent", "gain-half-a-percent", "half-a-pixel", "a-tenth-of-a-pixel"],
)
def test_faults_are_found_and_named(ours, thresholds, expected) -> None:
    outcome = check(Painter(ours, 1), Painter(scene(), 2), *thresholds, samples=256)
    assert expected <= failed(outcome)
    assert "noise" not in failed(outcome)


def test_a_difference_within_the_margin_passes() -> None:
    outcome = check(Painter(1.004 * scene(), 1), Painter(scene(), 2), samples=256)
    assert outcome.verdict is Verdict.PASS


def test_a_tile_is_found() -> None:
    ours = scene()
    ours[16:24, 24:32] *= 1.08
    outcome = check(Painter(ours, 1), Painter(scene(), 2), "flip=off", samples=256)
    assert failed(outcome) == {"tiles"}
    assert np.argwhere(outcome.light.tiles.is_significant.any(axis=2)).tolist() == [[2, 3]]


def test_what_looks_different_is_found_though_the_light_is_the_same() -> None:
    """Stripes of a pixel, which no mean of a tile shows."""
    ours = scene()
    ours[:, ::2] *= 1.3
    ours[:, 1::2] *= 0.7
    outcome = check(Painter(ours, 1), Painter(scene(), 2), samples=256)
    assert "looks" in failed(outcome)


@pytest.mark.parametrize(("right", "down"), [(0.3, 0.0), (0.0, -0.2), (-0.25, 0.15)])
def test_a_shift_is_measured(right: float, down: float) -> None:
    ours = Painter(scene(right, down), 1).render(256, N_BATCHES, 1)
    for reference in (ref := Painter(scene(), 2).render(256, N_BATCHES, 1), stored(ref)):
        both = measure_shift(ours, reference)
        assert both is not None
        shift = both[0].mean - both[1].mean
        error = np.sqrt(both[0].variance + both[1].variance)
        # First order in the shift: a few percent of it are left.
        assert np.abs(shift - [right, down]) == pytest.approx(0.0, abs=4.0 * error.max() + 0.015)


def test_a_brighter_image_is_not_displaced() -> None:
    ours = Painter(1.2 * scene(), 1, noise=1e-3).render(16, N_BATCHES, 1)
    reference = Painter(scene(), 2, noise=1e-3).render(16, N_BATCHES, 1)
    both = measure_shift(ours, reference)
    assert both is not None
    assert np.abs(both[0].mean - both[1].mean).max() < 1e-3


def test_a_flat_picture_has_no_place() -> None:
    flat = [Painter(np.ones((16, 16, 3)), i).render(4, N_BATCHES, 1) for i in (1, 2)]
    assert measure_shift(*flat) is None


class Repeating(Painter):
    """Takes its first samples again and again, and believes them to be new ones."""

    def render(self, samples_per_batch: int, n: int, first_seed: int) -> Batches:
        few = super().render(min(samples_per_batch, 8), n, first_seed)
        factor = few.samples_per_batch / samples_per_batch
        assert few.claimed_variance is not None
        return Batches("repeating", few.images, samples_per_batch, factor * few.claimed_variance)


class SameInEveryPixel(Painter):
    """Takes the same random numbers in every pixel."""

    def render(self, samples_per_batch: int, n: int, first_seed: int) -> Batches:
        batches = super().render(samples_per_batch, n, first_seed)
        errors = (batches.images - self.truth)[:, :1, :1]
        images = (self.truth + errors).astype(np.float32)
        return Batches("same", images, samples_per_batch, batches.claimed_variance)


class SameForEverySeed(Painter):
    def render(self, samples_per_batch: int, n: int, first_seed: int) -> Batches:
        batches = super().render(samples_per_batch, n, first_seed)
        images = np.repeat(batches.images[:1], n, axis=0)
        return Batches("same", images, samples_per_batch, batches.claimed_variance)


def test_noise_is_as_promised_for_independent_samples() -> None:
    painter = Painter(scene(), 3)
    noise = measure_noise(painter.render(64, N_BATCHES, 1), painter.render(16, N_BATCHES, 1), 8)
    assert noise.over_claim == pytest.approx(1.0, abs=0.1)
    assert noise.over_fewer_samples == pytest.approx(1.0, abs=0.15)
    assert noise.over_pixels == pytest.approx(1.0, abs=0.25)
    assert not noise.has_equal_seeds


@pytest.mark.parametrize("fault", [Repeating, SameInEveryPixel, SameForEverySeed])
def test_a_sampler_that_repeats_is_found(fault) -> None:
    outcome = check(fault(scene(), 1), Painter(scene(), 2))
    assert "noise" in failed(outcome)


def test_pixels_that_are_not_finite_are_counted_and_left_out() -> None:
    ours = Painter(scene(), 1).render(16, N_BATCHES, 1)
    ours.images[3, 5, 7, 1] = np.nan
    reference = Painter(scene(), 2).render(16, N_BATCHES, 1)
    reference.images[0, 9, 9, 0] = np.inf
    light = compare_light(ours, reference, 8, Criteria())
    assert (light.n_invalid_ours, light.n_invalid_reference) == (1, 1)
    assert np.isfinite(light.tiles.t).all()
    shape = compare_shape(light, Criteria())
    findings = judge(light, shape, measure_noise(light.ours, None, 8), Criteria())
    assert next(f for f in findings if f.name == "finite").verdict is Verdict.FAIL


def test_images_of_different_size_cannot_be_compared() -> None:
    ours = Painter(scene(), 1).render(4, N_BATCHES, 1)
    other = Painter(scene()[:, :50], 2).render(4, N_BATCHES, 1)
    with pytest.raises(CannotCheckError, match="56x40 here, 50x40 in the reference"):
        compare_light(ours, other, 8, Criteria())


def test_black_images_are_equal() -> None:
    black = [Painter(np.zeros((16, 16, 3)), i, noise=0.0).render(4, N_BATCHES, 1) for i in (1, 2)]
    light = compare_light(*black, 8, Criteria())
    assert not light.tiles.is_significant.any()
    assert light.image.difference.tolist() == [[[0.0] * 3]]


def test_dark_tiles_are_measured_against_the_image() -> None:
    assert scale_of(np.array([2.0, 0.001, -0.5]), 1.0).tolist() == [2.0, 0.1, 0.5]


def test_tiles_at_the_edge_are_smaller() -> None:
    image = np.arange(5 * 7, dtype=float).reshape(5, 7, 1)
    means = tile_means(image, 4)
    assert means.shape == (2, 2, 1)
    assert means[1, 1, 0] == image[4:, 4:].mean()
    assert tile_means(np.ones((5, 7, 1)), 4, total=True)[..., 0].tolist() == [[16, 12], [4, 3]]


def test_too_few_samples_are_inconclusive() -> None:
    outcome = check(Painter(scene(), 1), Painter(scene(), 2), samples=4)
    assert outcome.verdict is Verdict.INCONCLUSIVE
    assert failed(outcome) == set()


def test_a_failure_weighs_more_than_doubt() -> None:
    outcome = check(Painter(1.5 * scene(), 1), Painter(scene(), 2), samples=4)
    assert verdict_of(outcome.findings) is Verdict.FAIL


def test_as_many_samples_as_needed_are_taken() -> None:
    """Twice the noise takes four times the samples, and then the power is there."""
    counts = []
    for noise in (NOISE, 2.0 * NOISE):
        engines = [Painter(scene(), i, noise) for i in (1, 2)]
        outcome = run_check(*engines, Criteria(), Budget(N_BATCHES, 16, 1 << 20))
        assert outcome.verdict is Verdict.PASS
        assert outcome.light.image.detectable.max() <= 0.01
        counts.append(outcome.rounds[-1])
    assert counts[1] == 4 * counts[0]


def test_a_noisy_stored_reference_is_not_rendered_against_for_ever() -> None:
    reference = stored(Painter(scene(), 2, noise=10.0).render(4, N_BATCHES, 1))
    light = compare_light(Painter(scene(), 1).render(4, N_BATCHES, 1), reference, 8, Criteria())
    assert math.isinf(samples_wanted(light, 64, Criteria()))


def test_samples_are_powers_of_two_within_the_budget() -> None:
    budget = Budget(16, 64, 3000)
    assert [round_up(n, budget) for n in (1.0, 16.0, 17.0, 900.0, 1e9, math.inf)] == [
        1, 1, 2, 64, 128, 128,
    ]  # fmt: skip


def test_a_reference_survives_its_file(tmp_path) -> None:
    batches = Painter(scene(), 2).render(64, N_BATCHES, 1)
    file = tmp_path / "reference.exr"
    header = {"filter": "box", "max_depth": 16, "filter_radius": None}
    write_reference(file, batches, batches.n, header)
    assert [f.name for f in tmp_path.iterdir()] == ["reference.exr"]
    read = read_reference(file)
    assert read.image.mean == pytest.approx(batches.mean, rel=1e-6)
    assert read.image.pixel_variance == pytest.approx(batches.pixel_variance, rel=2e-3)
    assert (read.image.engine, read.image.n) == ("painter", N_BATCHES)
    assert read.image.samples_per_pixel == 64 * N_BATCHES
    assert read.settings == {
        "filter": "box", "max_depth": 16, "filter_radius": None, "resolution": [WIDTH, HEIGHT],
    }  # fmt: skip
    assert read.notes == ()


@pytest.mark.parametrize(
    "header", ["[]", "{", '{"batches": 1}', '{"samples": "many"}', '{"variance_scale": null}']
)
def test_a_header_that_makes_no_sense_is_an_error(tmp_path, header: str) -> None:
    file = tmp_path / "reference.exr"
    image = oiio.ImageBuf(oiio.ImageSpec(4, 4, 3, oiio.FLOAT))
    image.specmod().attribute("kilauea/reference", header)
    assert image.write(str(file))
    with pytest.raises(CannotCheckError, match="cannot read its attribute kilauea/reference"):
        read_reference(file)


def test_other_images_are_references_too(tmp_path) -> None:
    """With the variance of luminance that our own renders have, or without any."""
    spec = oiio.ImageSpec(2, 1, 4, oiio.FLOAT)
    spec.channelnames = ("R", "G", "B", "variance")
    image = oiio.ImageBuf(spec)
    image.set_pixels(oiio.ROI.All, np.float32([[[0.5, 0.5, 0.5, 0.01], [0.0, 0.0, 0.0, 0.0]]]))
    assert image.write(str(tmp_path / "ours.exr"))
    read = read_reference(tmp_path / "ours.exr")
    assert read.image.pixel_variance == pytest.approx(np.array([[[0.01] * 3, [0.0] * 3]]))
    assert "luminance" in read.notes[0]
    plain = oiio.ImageBuf(oiio.ImageSpec(2, 1, 3, oiio.FLOAT))
    assert plain.write(str(tmp_path / "plain.exr"))
    read = read_reference(tmp_path / "plain.exr")
    assert not read.image.pixel_variance.any()
    assert "free of noise" in read.notes[0]


def test_stored_and_fresh_references_give_the_same_figures() -> None:
    ours, reference = (Painter(scene(), i).render(64, N_BATCHES, 1) for i in (1, 2))
    fresh = compare_light(ours, reference, 8, Criteria())
    kept = compare_light(ours, stored(reference), 8, Criteria())
    assert kept.tiles.difference == pytest.approx(fresh.tiles.difference)
    # Over independent pixels, both variances are estimates of the same one.
    assert np.median(kept.tiles.error / fresh.tiles.error) == pytest.approx(1.0, abs=0.1)


def test_thresholds_are_read() -> None:
    criteria = parse_criteria(["image=0.25%", "tile=0.01", "flip=off", "power=95%", "shift=0"])
    assert (criteria.image, criteria.tile, criteria.shift) == (0.0025, 0.01, 0.0)
    assert (criteria.flip, criteria.power) == (math.inf, 0.95)
    assert parse_criteria(()) == Criteria()
    assert parse_criteria(["tile=off"]).tile_bias == math.inf


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("imag=1%", "unknown threshold 'imag'"),
        ("image", "cannot read threshold 'image'"),
        ("image=-1%", "cannot read"),
        ("image=nan", "cannot read"),
        ("power=off", "cannot read"),
        ("power=1", "cannot read"),
        ("noise=0.5", "at least 1"),
        ("image=2%", "image-bias must be above image"),
        ("tile-bias=1%", "tile-bias must be above tile"),
    ],
)
def test_thresholds_that_make_no_sense(word: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_criteria([word])
