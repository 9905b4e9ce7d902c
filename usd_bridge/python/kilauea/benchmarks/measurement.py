"""The renders of all engines at one stage, in turns, and the rows that they become."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean
from typing import Any

from kilauea.benchmarks import engines
from kilauea.benchmarks.engines import Run
from kilauea.benchmarks.image_error import (
    read_pixels,
    relative_weight,
    split,
    write_pixels,
)
from kilauea.benchmarks.job import Job
from kilauea.benchmarks.pace import Pace
from kilauea.benchmarks.reference import References
from kilauea.errors import KilaueaError
from kilauea.render import native


@dataclass(slots=True)
class Measurement:
    """Renders, compares, and collects rows."""

    job: Job
    references: References
    paces: dict[str, Pace]
    """Of the engines that take part."""
    skipped: dict[str, str]
    """Reasons why engines take no part, or not any more."""
    rows: list[dict[str, Any]] = field(default_factory=list)
    unreached: list[str] = field(default_factory=list)
    """Engines that cannot take one sample in a time."""
    _images: dict[str, Path] = field(default_factory=dict)

    def take_times(self, times_s: list[float], seeds: int) -> None:
        """Give each engine as many samples as it can take in each time."""
        for target_s in times_s:
            counts = {engine: pace.samples_in(target_s) for engine, pace in self.paces.items()}
            for engine in [engine for engine, count in counts.items() if count == 0]:
                del counts[engine]
                self.unreached.append(f"{engine}: not one sample in {target_s:g} s")
                print(f"kilauea: {self.job.name}: {self.unreached[-1]}", file=sys.stderr)
            self._take(counts, seeds, {"target_s": target_s})

    def take_counts(self, counts: list[int], seeds: int) -> None:
        """Give all engines the same numbers of samples."""
        for count in counts:
            self._take(dict.fromkeys(self.paces, count), seeds, {"target_s": None})

    def last_images(self) -> dict[str, Path]:
        """Return an image of each engine at the last time that it reached."""
        return self._images

    def _take(self, counts: dict[str, int], seeds: int, fields: dict[str, Any]) -> None:
        runs: dict[str, list[Run]] = {engine: [] for engine in counts}
        for seed in range(1, seeds + 1):
            for engine in [engine for engine in counts if engine in self.paces]:
                try:
                    run = engines.render(engine, self.job, counts[engine], seed)
                except KilaueaError as error:
                    self.skipped[engine] = str(error)
                    del self.paces[engine]
                    continue
                runs[engine].append(run)
        for engine, found in runs.items():
            if len(found) == seeds:
                self._add_rows(engine, found, fields | {"samples_asked": counts[engine]})
                self._images[engine] = found[0].image

    def _add_rows(self, engine: str, runs: list[Run], fields: dict[str, Any]) -> None:
        reference = self.references.of(engine)
        images = [read_pixels(run.image) for run in runs]
        parts = split(images, reference.mean, reference.variance_of_mean)
        agreed = self.references.agreed is not None
        weight = relative_weight(reference.mean)
        shared = {
            "reference": "agreed" if agreed else "own",
            "relMSE_of_reference": float((weight * reference.variance_of_mean).mean()),
            "variance": parts.variance,
            # Against its own image no engine has a bias that could be seen.
            "bias_squared": parts.bias_squared if agreed else None,
        }
        file = self.job.folder / "reference.exr"
        write_pixels(file, reference.mean)
        for seed, run in enumerate(runs, start=1):
            self.rows.append(row(self.job, run, seed, file) | fields | shared)


def row(job: Job, run: Run, seed: int, reference: Path) -> dict[str, Any]:
    """Compare one render with the reference."""
    found = json.loads(native().compare(str(run.image), str(reference)))
    return {
        "stage": job.name,
        "engine": run.engine,
        "version": run.version,
        "seed": seed,
        "samples_per_pixel": run.samples_per_pixel,
        "seconds": run.total_s,
        "load_s": run.load_s,
        "build_s": run.build_s,
        "render_s": run.render_s,
        "cpu_s": run.cpu_s,
        "peak_rss": run.peak_rss,
        "samples_per_s": run.samples_per_s(job.n_pixels),
        "rays_per_s": None if run.n_rays is None else run.n_rays / run.render_s,
        "relMSE": found["relMSE"],
        "trimmed_relMSE": found["trimmed_relMSE"],
        "MSE": found["MSE"],
        "mean_FLIP": found["mean_FLIP"],
        "mean_ratio": fmean(found["mean_ratio"]),
        "invalid": found["nan"] + found["inf"],
    }
