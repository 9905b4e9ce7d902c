"""The engines that are compared, each as a command that renders an exported scene."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilauea.benchmarks.job import Job
from kilauea.child import run_apart
from kilauea.environments import CYCLES, LUXCORE, MITSUBA, Environment, pipeline_script
from kilauea.reference import cycles_command

_READERS = ("exported.py", "tiles.py", "constant_inputs.py", "still_meshes.py")


@dataclass(frozen=True, slots=True)
class Run:
    """One render by one engine. Times are seconds, sizes bytes."""

    engine: str
    version: str
    """Name and version as the engine says them."""
    image: Path
    samples_per_pixel: float
    load_s: float
    """Reading the scene, ours from USD, others from the exported arrays."""
    build_s: float
    """Trees, shaders, synchronisation, kernels: the rest of what comes before the first ray."""
    render_s: float
    total_s: float
    """Wall time of the whole command, start-up included."""
    cpu_s: float
    """Processor time of the whole command, all threads."""
    peak_rss: int
    n_rays: int | None
    """None where the engine does not count them."""
    warnings: list[str]
    """What the engine could not take over from the scene."""

    @property
    def setup_s(self) -> float:
        """Time to the first ray, start-up left out."""
        return self.load_s + self.build_s

    def samples_per_s(self, n_pixels: int) -> float:
        """Camera paths per second of rendering."""
        return n_pixels * self.samples_per_pixel / self.render_s


@dataclass(frozen=True, slots=True)
class Engine:
    """How an engine is called, and what its statistics mean."""

    command: Callable[[Job, Path, Path, int, int], list[str]]
    """From job, image, statistics file, samples per pixel and seed."""
    parse: Callable[[dict[str, Any]], dict[str, Any]]
    """From its statistics to fields of `Run`."""
    release: str
    """Packages and flags that decide its images."""
    sources: tuple[str, ...] = ()
    """Files of `pipeline` that do so too, as patterns."""


def render(engine: str, job: Job, samples: int, seed: int) -> Run:
    """Render a job.

    Raises
    ------
    KilaueaError
        The engine cannot render it.
    """
    image = job.folder / f"{engine}-{samples}-{seed}.exr"
    stats_file = image.with_suffix(".json")
    called = ENGINES[engine]
    command = called.command(job, image, stats_file, samples, seed)
    done = run_apart(command, f"render with {engine}")
    return Run(
        engine,
        image=image,
        total_s=done.wall_s,
        cpu_s=done.cpu_s,
        **called.parse(json.loads(stats_file.read_text())),
    )


def _kilauea(integrator: str, *flags: str) -> Engine:
    def command(job: Job, image: Path, stats: Path, samples: int, seed: int) -> list[str]:
        settings = job.settings
        width, height = settings["resolution"]
        words = [sys.executable, "-m", "kilauea.cli", "render", job.stage, "-o", image]
        words += ["--integrator", integrator, "-r", width, height, "-p", samples]
        words += ["--seed", seed, "--max-depth", settings["max_depth"]]
        words += ["--filter", settings["filter"], "-j", settings["threads"]]
        words += ["--stats", stats, "-V", "0", *flags, *job.flags]
        return [str(word) for word in words]

    return Engine(command, _parse_ours, " ".join((integrator, *flags)))


def _parse_ours(stats: dict[str, Any]) -> dict[str, Any]:
    times = stats["times"]
    return {
        "version": "Kilauea",
        "samples_per_pixel": stats["samples_per_pixel"],
        "load_s": times["load"],
        "build_s": times.get("build", 0.0),
        "render_s": sum(times.get(name, 0.0) for name in ("photon", "gather", "render")),
        "peak_rss": stats["memory"]["peak_rss"],
        "n_rays": sum(stats["rays"].values()),
        "warnings": stats["warnings"],
    }


def _cycles(*flags: str) -> Engine:
    def command(job: Job, image: Path, stats: Path, samples: int, seed: int) -> list[str]:
        words = ("--samples", str(samples), "--seed", str(seed), *flags)
        return cycles_command(job.folder, image, stats, *words)

    release = " ".join((*CYCLES.requirements, *flags))
    sources = ("cycles_render.py", "blender_scene/*.py", *_READERS)
    return Engine(command, lambda stats: _parse_theirs(stats, "sync_s"), release, sources)


def _scripted(environment: Environment, script: str, *flags: str) -> Engine:
    """Call a script of `pipeline` in its environment."""

    def command(job: Job, image: Path, stats: Path, samples: int, seed: int) -> list[str]:
        words = [environment.python(), pipeline_script(script), job.folder, image]
        words += ["--samples", samples, "--seed", seed, "--stats", stats, *flags]
        return [str(word) for word in words]

    release = " ".join((*environment.requirements, *flags))
    sources = (script, script.replace("render.py", "scene/*.py"), *_READERS)
    return Engine(command, lambda stats: _parse_theirs(stats, "compile_s"), release, sources)


def _parse_theirs(stats: dict[str, Any], preparation: str) -> dict[str, Any]:
    """Read what the scripts of `pipeline` write; `preparation` is what follows loading."""
    return {
        "version": stats["engine"],
        "samples_per_pixel": stats["samples_per_pixel"],
        "load_s": stats["build_s"],
        "build_s": stats[preparation],
        "render_s": stats["render_s"],
        "peak_rss": stats["peak_rss"],
        "n_rays": None,
        "warnings": stats["warnings"],
    }


ENGINES: dict[str, Engine] = {
    "kilauea": _kilauea("kilauea"),
    "kilauea-consistent": _kilauea("kilauea", "--gi", "consistent"),
    "path": _kilauea("path"),
    "cycles": _cycles(),
    "cycles-guided": _cycles("--guiding"),
    "mitsuba": _scripted(MITSUBA, "mitsuba_render.py", "--sampler", "independent"),
    "mitsuba-stratified": _scripted(MITSUBA, "mitsuba_render.py", "--sampler", "multijitter"),
    "luxcore": _scripted(LUXCORE, "luxcore_render.py"),
    "luxcore-hybrid": _scripted(LUXCORE, "luxcore_render.py", "--engine", "hybrid"),
    "luxcore-bidir": _scripted(LUXCORE, "luxcore_render.py", "--engine", "bidir"),
    "luxcore-bidirvm": _scripted(LUXCORE, "luxcore_render.py", "--engine", "bidirvm"),
    "luxcore-photongi": _scripted(LUXCORE, "luxcore_render.py", "--engine", "photongi"),
}
"""By name; `path` is our path tracer, `cycles-guided` has path guiding on. Mitsuba has no Sobol
sequence: its default sampler is as fast as it gets, the stratified one as clean. LuxCore's variants
find caustics: by paths from lights, from both sides, these merged, by caches of photons."""

OURS = ("kilauea", "kilauea-consistent", "path")
"""Engines that never decide alone what is right."""

BIASED = ("kilauea-consistent", "luxcore-bidirvm", "luxcore-photongi")
"""Engines that merge photons, so that their mean is right in the limit of small radii alone: they
are witnesses of light that others miss, and no two of them decide."""
