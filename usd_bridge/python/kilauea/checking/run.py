"""A check from the first sample to the verdict."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from kilauea.checking.compare import Light, Shape, compare_light, compare_shape
from kilauea.checking.criteria import Criteria
from kilauea.checking.judge import Finding, Verdict, judge, verdict_of
from kilauea.checking.noise import Noise, measure_noise
from kilauea.checking.plan import Budget, round_up, samples_wanted
from kilauea.checking.sources import BatchSource, Source

MIN_GROWTH = 4
"""From the first round to the second: enough to see whether noise falls with the samples."""


@dataclass(frozen=True)
class Outcome:
    """What a check found."""

    criteria: Criteria
    light: Light
    shape: Shape
    noise: Noise
    findings: list[Finding]
    rounds: list[int]
    """Samples per pixel of each engine in each round; the last one is judged."""

    @property
    def verdict(self) -> Verdict:
        """The gravest of the findings."""
        return verdict_of(self.findings)


def run_check(
    ours: BatchSource,
    reference: Source,
    criteria: Criteria,
    budget: Budget,
    *,
    tile: int | None = None,
    first_seed: int = 1,
    say: Callable[[str], None] = lambda _: None,
) -> Outcome:
    """Render in rounds until the samples suffice or are used up, and judge the last round.

    What ends the rounds is the noise alone, never the difference, so that looking several times
    does not make a false alarm likelier.
    """

    def one_round(samples: int) -> Light:
        say(f"{budget.batches} batches of {samples} samples per pixel")
        batches = ours.render(samples, budget.batches, first_seed)
        expected = reference.render(samples, budget.batches, first_seed)
        return compare_light(batches, expected, tile, criteria)

    samples = round_up(budget.first, budget)
    first = light = one_round(samples)
    rounds = [light.ours.samples_per_pixel]
    while following := _next_round(samples, light, criteria, budget, is_first=light is first):
        samples = following
        light = one_round(samples)
        rounds.append(light.ours.samples_per_pixel)
    shape = compare_shape(light, criteria)
    fewer = first.ours if light is not first else None
    noise = measure_noise(light.ours, fewer, light.tile)
    findings = judge(light, shape, noise, criteria)
    return Outcome(criteria, light, shape, noise, findings, rounds)


def _next_round(
    samples: int, light: Light, criteria: Criteria, budget: Budget, *, is_first: bool
) -> int | None:
    """Return the samples per batch of another round, or None where there is no need or no use."""
    most = round_up(budget.last, budget)
    wanted = samples_wanted(light, light.ours.samples_per_pixel, criteria)
    if budget.is_fixed:
        return most if is_first and samples < most else None
    is_enough = wanted <= budget.batches * samples or math.isinf(wanted)
    if samples >= most or (is_enough and not is_first):
        return None
    least = (MIN_GROWTH if is_first else 2) * samples
    return min(least if is_enough else max(least, round_up(wanted, budget)), most)
