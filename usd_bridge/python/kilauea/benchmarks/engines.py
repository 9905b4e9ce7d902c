"""The engines that are compared, each as one render of an exported scene."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilauea.environments import MITSUBA, checked, pipeline_script
from kilauea.errors import KilaueaError
from kilauea.reference import export_frame, run_cycles
from kilauea.render import RenderOptions


@dataclass(frozen=True, slots=True)
class Job:
    """A stage at fixed settings, flattened once for all engines."""

    stage: str
    folder: Path
    """The exported scene; images go beside it."""
    settings: dict[str, Any]

    @classmethod
    def prepare(cls, stage: str, folder: Path, settings: dict[str, Any]) -> Job:
        """Flatten and export a stage; `settings` stand over those of the stage."""
        from kilauea.usd.options import FlattenOptions
        from kilauea.usd.stage import flatten

        folder.mkdir(parents=True)
        resolution = settings.get("resolution")
        options = FlattenOptions(resolution=tuple(resolution) if resolution else None)
        render_options = RenderOptions([], settings)
        return cls(stage, folder, export_frame(flatten(stage, options), render_options, folder))

    @property
    def n_pixels(self) -> int:
        """Pixels of the image."""
        width, height = self.settings["resolution"]
        return width * height


@dataclass(frozen=True, slots=True)
class Run:
    """One render by one engine."""

    engine: str
    image: Path
    samples_per_pixel: int
    build_s: float
    """Until the first ray: loading, building, kernels."""
    render_s: float
    total_s: float
    """Of the whole command, start-up included."""
    peak_rss: int
    """Bytes."""

    def samples_per_s(self, n_pixels: int) -> float:
        """Camera paths per second of rendering."""
        return n_pixels * self.samples_per_pixel / self.render_s


def render(engine: str, job: Job, samples: int, seed: int) -> Run:
    """Render a job.

    Raises
    ------
    KilaueaError
        The engine cannot render it.
    """
    image = job.folder / f"{engine}-{samples}-{seed}.exr"
    start = time.perf_counter()
    stats = ENGINES[engine](job, image, samples, seed)
    total_s = time.perf_counter() - start
    return Run(engine, image, samples, total_s=total_s, **stats)


def _kilauea(integrator: str) -> Callable[[Job, Path, int, int], dict[str, Any]]:
    def run(job: Job, image: Path, samples: int, seed: int) -> dict[str, Any]:
        settings = job.settings
        stats_file = image.with_suffix(".json")
        width, height = settings["resolution"]
        command = [sys.executable, "-m", "kilauea.cli", "render", job.stage, "-o", image]
        command += ["--integrator", integrator, "-r", width, height, "-p", samples]
        command += ["--seed", seed, "--max-depth", settings["max_depth"]]
        command += ["--filter", settings["filter"], "-j", settings["threads"]]
        command += ["--stats", stats_file, "-V", "0"]
        checked([str(word) for word in command], "render with Kilauea")
        stats = json.loads(stats_file.read_text())
        times = stats["times"]
        return {
            "build_s": times["load"] + times.get("build", 0.0),
            "render_s": sum(times.get(name, 0.0) for name in ("photon", "gather", "render")),
            "peak_rss": stats["memory"]["peak_rss"],
        }

    return run


def _cycles(*flags: str) -> Callable[[Job, Path, int, int], dict[str, Any]]:
    def run(job: Job, image: Path, samples: int, seed: int) -> dict[str, Any]:
        words = ("--samples", str(samples), "--seed", str(seed), *flags)
        stats = run_cycles(job.folder, image, *words)
        build_s = stats["build_s"] + stats["sync_s"]
        return {
            "build_s": build_s,
            "render_s": stats["render_s"],
            "peak_rss": stats["peak_rss"],
        }

    return run


def _mitsuba(sampler: str) -> Callable[[Job, Path, int, int], dict[str, Any]]:
    def run(job: Job, image: Path, samples: int, seed: int) -> dict[str, Any]:
        stats_file = image.with_suffix(".json")
        command = [MITSUBA.python(), pipeline_script("mitsuba_render.py"), job.folder, image]
        command += ["--samples", samples, "--seed", seed, "--stats", stats_file]
        command += ["--sampler", sampler]
        try:
            checked([str(word) for word in command], "render with Mitsuba")
        except KilaueaError as error:
            if "drjit_" in str(error):
                raise KilaueaError(
                    "Mitsuba needs LLVM 16 or newer: set DRJIT_LIBLLVM_PATH to its libLLVM"
                ) from None
            raise
        stats = json.loads(stats_file.read_text())
        return {
            "build_s": stats["build_s"] + stats["compile_s"],
            "render_s": stats["render_s"],
            "peak_rss": stats["peak_rss"],
        }

    return run


ENGINES: dict[str, Callable[[Job, Path, int, int], dict[str, Any]]] = {
    "kilauea": _kilauea("kilauea"),
    "path": _kilauea("path"),
    "cycles": _cycles(),
    "cycles-guided": _cycles("--guiding"),
    "mitsuba": _mitsuba("independent"),
    "mitsuba-stratified": _mitsuba("multijitter"),
}
"""By name; `path` is our path tracer, `cycles-guided` has path guiding on. Mitsuba has no Sobol
sequence: its default sampler is as fast as it gets, the stratified one as clean."""
