"""How many samples an engine takes in a given time, learnt from renders."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from kilauea.benchmarks.engines import Run

CLOCKS = ("wall", "cpu")
"""What times are measured with: wall time, or processor time of all threads, which other work on
the machine changes little."""

PILOT_S = 1.0
"""A difference between two renders that tells the pace."""
MAX_PILOT_SAMPLES = 4096
_FIRST_SAMPLES = 1
_MAX_GROWTH = 16


@dataclass(frozen=True, slots=True)
class Pace:
    """The pace of one engine at one stage."""

    fixed_s: float
    """Outside of rendering."""
    per_sample_s: float
    """Of a sample in every pixel."""

    @classmethod
    def between(cls, short: Run, long: Run, clock: str) -> Pace:
        """Draw a line through two renders; the second has more samples."""
        times = [run.total_s if clock == "wall" else run.cpu_s for run in (short, long)]
        samples = [run.samples_per_pixel for run in (short, long)]
        # Where other work on the machine was in the way of the first, the line may fall.
        per_sample_s = max((times[1] - times[0]) / (samples[1] - samples[0]), 1e-6)
        return cls(max(times[1] - samples[1] * per_sample_s, 0.0), per_sample_s)

    def samples_in(self, seconds: float) -> int:
        """Return the samples per pixel of a command of that length; 0 where none would be done."""
        return max(0, math.floor((seconds - self.fixed_s) / self.per_sample_s))


def pilot(render: Callable[[int], Run], clock: str) -> tuple[Pace, Run]:
    """Render with more and more samples until the pace can be told; returns the last render too."""
    first = render(_FIRST_SAMPLES)
    samples = _FIRST_SAMPLES
    while True:
        # A guess at the time of a sample, high on the safe side.
        growth = 2.0 * PILOT_S / max(first.render_s, 0.01) if samples == _FIRST_SAMPLES else 4.0
        samples = min(MAX_PILOT_SAMPLES, samples * max(2, min(_MAX_GROWTH, math.ceil(growth))))
        last = render(samples)
        pace = Pace.between(first, last, clock)
        difference_s = pace.per_sample_s * (last.samples_per_pixel - first.samples_per_pixel)
        if difference_s >= PILOT_S or samples == MAX_PILOT_SAMPLES:
            return pace, last
