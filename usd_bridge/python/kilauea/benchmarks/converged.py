"""Converged images of an engine: the mean of long renders with seeds of their own, cached."""

from __future__ import annotations

import hashlib
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kilauea.benchmarks import engines
from kilauea.benchmarks.agreement import tile_means
from kilauea.benchmarks.engines import OURS, Run
from kilauea.benchmarks.image_error import Moments, Pixels, read_pixels
from kilauea.benchmarks.job import Job
from kilauea.benchmarks.pace import Pace
from kilauea.environments import cache_folder, pipeline_script
from kilauea.render import native

FIRST_SEED = 10_001
"""Far from the seeds that are measured."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much goes into the converged image of one engine."""

    seconds: float
    """Of rendering, for each seed."""
    seeds: int


@dataclass(frozen=True, slots=True)
class Converged:
    """The mean of an engine's long renders."""

    engine: str
    version: str
    samples_per_pixel: float
    """Of all renders together."""
    render_s: float
    mean: Pixels
    variance_of_mean: Pixels
    tiles: Pixels
    """(renders, rows, columns, channels), means over tiles."""

    def record(self) -> dict[str, Any]:
        """Return what a ledger says of it."""
        return {
            "engine": self.engine,
            "version": self.version,
            "samples_per_pixel": self.samples_per_pixel,
            "render_s": self.render_s,
            "seeds": len(self.tiles),
        }


def converged(job: Job, engine: str, pace: Pace, effort: Effort) -> Converged:
    """Return an engine's converged image, from the cache where it is there.

    Raises
    ------
    KilaueaError
        The engine cannot render the job.
    """
    digest = _cache_key(job, engine, effort)
    file = cache_folder() / "references" / f"{engine}-{digest[:24]}.npz"
    if not file.is_file():
        samples = max(1, round(effort.seconds / pace.per_sample_s))
        print(
            f"kilauea: {job.name}: {effort.seeds} times {samples} samples with {engine} "
            "to converge",
            file=sys.stderr,
        )
        seeds = range(FIRST_SEED, FIRST_SEED + effort.seeds)
        runs = [engines.render(engine, job, samples, seed) for seed in seeds]
        _write(file, _mean_of(runs))
        for run in runs:
            run.image.unlink()
    return _read(file)


def _mean_of(runs: list[Run]) -> Converged:
    images = [read_pixels(run.image) for run in runs]
    moments = Moments.of(images)
    return Converged(
        engine=runs[0].engine,
        version=runs[0].version,
        samples_per_pixel=sum(run.samples_per_pixel for run in runs),
        render_s=sum(run.render_s for run in runs),
        mean=moments.mean,
        variance_of_mean=moments.variance_of_mean,
        tiles=np.stack([tile_means(image) for image in images]),
    )


def _cache_key(job: Job, engine: str, effort: Effort) -> str:
    """Digest the scene, the engine and the effort."""
    called = engines.ENGINES[engine]
    digest = hashlib.sha256(f"{job.content_hash()} {engine} {effort} {called.release}".encode())
    if engine in OURS:
        sources = [Path(native().__file__)]
    else:
        folder = pipeline_script("exported.py").parent
        sources = [file for name in called.sources for file in sorted(folder.glob(name))]
    for file in sources:
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _write(file: Path, image: Converged) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(f".{os.getpid()}.npz")
    np.savez_compressed(
        partial,
        record=json.dumps(image.record()),
        mean=np.float32(image.mean),
        variance_of_mean=np.float32(image.variance_of_mean),
        tiles=image.tiles,
    )
    partial.replace(file)


def _read(file: Path) -> Converged:
    with np.load(file) as arrays:
        record = json.loads(str(arrays["record"]))
        record.pop("seeds")
        return Converged(
            **record,
            mean=arrays["mean"].astype(np.float64),
            variance_of_mean=arrays["variance_of_mean"].astype(np.float64),
            tiles=arrays["tiles"],
        )
