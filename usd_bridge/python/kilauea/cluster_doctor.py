"""`kilauea cluster doctor`: whether the machines of a Ray cluster can render together."""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kilauea.environments import cache_folder
from kilauea.output import write_text
from kilauea.ray_cluster import connect, on_each_machine
from kilauea.render import native

_ANSWER_SECS = 60.0
_MAX_CLOCK_SKEW_SECS = 1.0
"""Certificates are valid by the clock, and logs are read by it."""
_LEAST_SHARED_MEMORY = 64 << 20


@dataclass(frozen=True, slots=True)
class Machine:
    """What a machine says of itself."""

    host: str
    build: str | None
    """Hash of the engine's sources and build; None where it cannot be loaded."""
    error: str
    """Why it cannot."""
    cores: int
    memory_bytes: int
    shared_memory_bytes: int
    tile_files: str
    """Folder of the tile files of textures, which workers open by their paths."""
    has_tile_files: bool
    clock: float
    """Seconds since 1970."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is wrong with a machine, or may become so."""

    host: str
    is_error: bool
    text: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("what", choices=("doctor",), help="look at each machine")
    parser.add_argument("--cluster", default="auto", metavar="ADDRESS", help="auto by default")
    parser.add_argument("--json", metavar="FILE", help="machines and findings")


def main(args: argparse.Namespace) -> int:
    """Look at each machine and say what is wrong; 1 where they cannot render together."""
    ray = connect(args.cluster)
    try:
        before = examine()
        machines = on_each_machine(ray, examine, _ANSWER_SECS)
        after = examine()
    finally:
        ray.shutdown()
    findings = diagnose(before, after, machines)
    for machine in machines:
        memory, shared = (n / 2**30 for n in (machine.memory_bytes, machine.shared_memory_bytes))
        print(f"{machine.host}: {machine.cores} cores, {memory:.1f} GiB, {shared:.1f} GiB shared")
    for finding in findings:
        print(f"{finding.host}: {'error' if finding.is_error else 'warning'}: {finding.text}")
    if args.json:
        found = {
            "machines": [dataclasses.asdict(machine) for machine in machines],
            "findings": [dataclasses.asdict(finding) for finding in findings],
        }
        write_text(Path(args.json), json.dumps(found, indent=2) + "\n")
    has_errors = any(finding.is_error for finding in findings)
    print("these machines cannot render together" if has_errors else "they can render together")
    return int(has_errors)


def examine() -> Machine:
    """Return what this machine is."""
    build, error = None, ""
    try:
        build = native().build_hash()
    except Exception as fault:  # Whatever keeps the engine from loading is what is asked for.
        error = str(fault)
    tile_files = cache_folder()
    return Machine(
        host=os.uname().nodename,
        build=build,
        error=error,
        cores=os.cpu_count() or 1,
        memory_bytes=os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"),
        shared_memory_bytes=shutil.disk_usage("/dev/shm").total,
        tile_files=str(tile_files),
        has_tile_files=tile_files.is_dir(),
        clock=time.time(),
    )


def diagnose(before: Machine, after: Machine, machines: Sequence[Machine]) -> list[Finding]:
    """Return what keeps machines from rendering what this one would, errors first.

    `before` and `after` are this machine, examined before and after the others.
    """
    findings: list[Finding] = []
    for machine in machines:

        def find(is_error: bool, text: str, host: str = machine.host) -> None:
            findings.append(Finding(host, is_error, text))

        if machine.build is None:
            find(True, f"kilauea cannot be loaded: {machine.error}")
        elif machine.build != before.build:
            find(True, f"another build of kilauea: {machine.build}, and here {before.build}")
        skew = max(before.clock - machine.clock, machine.clock - after.clock)
        if skew > _MAX_CLOCK_SKEW_SECS:
            find(False, f"its clock is off by {skew:.1f} s")
        if machine.shared_memory_bytes < _LEAST_SHARED_MEMORY:
            mebibytes = machine.shared_memory_bytes >> 20
            find(False, f"/dev/shm has {mebibytes} MiB, and Ray keeps its objects there")
        if before.has_tile_files and not machine.has_tile_files:
            find(
                False,
                f"{machine.tile_files} is not there: textures will be missing; see KILAUEA_CACHE",
            )
    return sorted(findings, key=lambda finding: not finding.is_error)
