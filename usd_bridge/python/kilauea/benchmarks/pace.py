"""How many samples an engine takes in a given time, learnt from renders."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from kilauea.benchmarks.engines import Run

PILOT_S = 1.0
"""A render this long tells the pace."""
MAX_PILOT_SAMPLES = 4096
_FIRST_SAMPLES = 2
_MAX_GROWTH = 16


@dataclass(slots=True)
class Pace:
    """The pace of one engine at one stage."""

    fixed_s: float
    """Wall time outside of rendering."""
    per_sample_s: float
    """Rendering time of a sample in every pixel."""

    @classmethod
    def of(cls, run: Run) -> Pace:
        """Take over what a run took."""
        # Cycles rounds to 10 ms.
        render_s = max(run.render_s, 0.005)
        return cls(run.total_s - run.render_s, render_s / run.samples_per_pixel)

    def samples_in(self, seconds: float) -> int:
        """Return the samples per pixel of a command of that length; 0 where none would be done."""
        return max(0, math.floor((seconds - self.fixed_s) / self.per_sample_s))


def pilot(render: Callable[[int], Run]) -> Run:
    """Render with more and more samples until a run tells the pace."""
    samples = _FIRST_SAMPLES
    while True:
        run = render(samples)
        if run.render_s >= PILOT_S or samples >= MAX_PILOT_SAMPLES:
            return run
        growth = 1.5 * PILOT_S / max(run.render_s, 0.01)
        samples = min(MAX_PILOT_SAMPLES, samples * max(2, min(_MAX_GROWTH, math.ceil(growth))))
