"""Planted faults: `kilauea check` must find each, and nothing where there is none.

The references are Cycles', stored with their variance (tests/references). Faults are planted in
the flattened frame, just before the engine sees it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("kilauea._native")

from kilauea.checking.criteria import parse_criteria
from kilauea.checking.images import Batches
from kilauea.checking.judge import Verdict
from kilauea.checking.plan import Budget
from kilauea.checking.run import Outcome, run_check
from kilauea.checking.sources import KilaueaSource, StoredSource
from kilauea.checking.stored import Reference, read_reference
from kilauea.payload import Frame
from kilauea.render import RenderOptions
from kilauea.usd.options import FlattenOptions
from kilauea.usd.stage import flatten

TESTS = Path(__file__).parents[2] / "tests"
BUDGET = Budget(batches=16, first=64, last=512, is_fixed=True)
CRITERIA = parse_criteria(["image=0.1%", "image-bias=0.5%", "tile=1%", "tile-bias=10%"])
BOX, DISK, BALLS = "box_rect_light", "focused_disk", "shader_balls"


@cache
def reference(stage: str) -> Reference:
    return read_reference(TESTS / f"references/{stage}.exr")


def sources(stage: str) -> tuple[KilaueaSource, StoredSource]:
    stored = reference(stage)
    width, height = stored.settings["resolution"]
    frame = flatten(str(TESTS / f"scenes/{stage}.usda"), FlattenOptions(resolution=(width, height)))
    return (
        KilaueaSource(frame, RenderOptions([], dict(stored.settings))),
        StoredSource(stored.image),
    )


def check(stage: str, plant: Callable[[Frame], None] = lambda _: None) -> Outcome:
    ours, expected = sources(stage)
    plant(ours.frame)
    return run_check(ours, expected, CRITERIA, BUDGET)


def failed(outcome: Outcome) -> set[str]:
    return {f.name for f in outcome.findings if f.verdict is Verdict.FAIL}


@pytest.mark.parametrize("stage", [BOX, DISK, BALLS])
def test_without_a_fault_the_check_passes(stage: str) -> None:
    outcome = check(stage)
    assert outcome.verdict is Verdict.PASS, [f.summary for f in outcome.findings]


def brighter_light(frame: Frame) -> None:
    light = frame.lights[0]
    light["radiance"] = [1.01 * value for value in light["radiance"]]


def dropped_cosine(frame: Frame) -> None:
    frame.lights[0]["shaping"]["focus"] = 0.0


def half_a_pixel(frame: Frame) -> None:
    left, bottom, right, top = frame.camera["screen_window"]
    offset = 0.5 * (right - left) / reference(BOX).settings["resolution"][0]
    frame.camera["screen_window"] = [left + offset, bottom, right + offset, top]


def energy_gain(frame: Frame) -> None:
    for mesh in (*frame.meshes, *frame.implicits):
        for primvar in mesh.primvars:
            primvar.values = np.float32(1.005) * primvar.values


@pytest.mark.parametrize(
    ("stage", "plant", "finding"),
    [
        (BOX, brighter_light, "image"),
        (DISK, dropped_cosine, "image"),
        (DISK, dropped_cosine, "tiles"),
        (BOX, half_a_pixel, "shift"),
        (BOX, energy_gain, "image"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_a_planted_fault_is_found(stage: str, plant: Callable[[Frame], None], finding: str) -> None:
    assert finding in failed(check(stage, plant))


@dataclass
class Repeating:
    """Takes its first samples again and again, and believes them to be new ones."""

    ours: KilaueaSource
    period: int

    def render(self, samples_per_batch: int, n: int, first_seed: int, /) -> Batches:
        few = self.ours.render(min(samples_per_batch, self.period), n, first_seed)
        repeats = samples_per_batch // few.samples_per_batch
        # Each sample counts several times, so the estimated variance is divided once more.
        claimed = few.claimed_variance / np.float32(repeats)
        return replace(few, samples_per_batch=samples_per_batch, claimed_variance=claimed)


def test_a_sampler_that_repeats_is_found() -> None:
    ours, expected = sources(BOX)
    outcome = run_check(Repeating(ours, period=4), expected, CRITERIA, BUDGET)
    assert "noise" in failed(outcome)
    assert outcome.noise.over_fewer_samples == pytest.approx(8.0, rel=1e-6)


def test_seeds_that_are_ignored_are_found() -> None:
    ours, expected = sources(BOX)

    @dataclass
    class Unseeded:
        def render(self, samples_per_batch: int, n: int, first_seed: int, /) -> Batches:
            one = ours.render(samples_per_batch, 1, first_seed)
            return replace(one, images=np.repeat(one.images, n, axis=0))

    outcome = run_check(Unseeded(), expected, CRITERIA, BUDGET)
    assert "noise" in failed(outcome)
