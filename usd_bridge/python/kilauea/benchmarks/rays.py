"""`kilauea bench rays`: our ray kernels against Embree's, on the same triangles and rays."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import geometric_mean
from typing import Any

from kilauea import interrupt
from kilauea.benchmarks.report import print_table, write_json
from kilauea.benchmarks.workloads import Limits, default_meshes, load
from kilauea.child import run_apart
from kilauea.environments import EMBREE
from kilauea.errors import KilaueaError, UsageError
from kilauea.render import native


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument(
        "meshes",
        nargs="*",
        metavar="MESH",
        help="a stage, or one of the shapes room, sphere, terrain; else these and stages of "
        "KILAUEA_ASSETS",
    )
    parser.add_argument("--mesh", metavar="FILE.mesh", help="triangles from a file")
    parser.add_argument("--rays", nargs="+", metavar="FILE.rays", help="rays against --mesh")
    parser.add_argument("--dump", metavar="FOLDER", help="write the meshes and rays there")
    parser.add_argument("--n-rays", type=int, default=1 << 17, help="about, of each kind")
    parser.add_argument("--rounds", type=int, default=15, help="of each batch of rays")
    parser.add_argument("--max-triangles", type=int, default=8_000_000, help="instances baked")
    parser.add_argument("--skip-builds", action="store_true", help="do not time the builds")
    parser.add_argument("--embree", metavar="LIBRARY", help="libembree4, else that of embreex")
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


def run(args: argparse.Namespace) -> int:
    """Measure, print and write."""
    check(args)
    library = args.embree or str(embree_library())
    limits = Limits(args.n_rays, args.max_triangles)
    meshes = args.meshes or ([] if args.mesh else default_meshes())
    threads = [] if args.skip_builds else sorted({1, len(os.sched_getaffinity(0))})
    rows: list[dict[str, Any]] = []
    builds: list[dict[str, Any]] = []
    skipped: list[str] = []
    loaders: list[Callable[[], Any]] = [partial(load, mesh, limits) for mesh in meshes]
    if args.mesh:
        loaders.append(partial(native().RayWorkload.read, args.mesh, args.rays))
    for loader in loaders:
        try:
            report = measure(loader, args.dump, library, args.rounds, threads)
        except KilaueaError as error:
            skipped.append(str(error))
            print(f"kilauea: {error}", file=sys.stderr)
        else:
            rows += report["rows"]
            builds += report["builds"]
        # After every mesh, so that a long run that is interrupted leaves what it has.
        write_json(args.json, rows, builds=builds, means=means(rows), skipped=skipped)
    for table in (side_by_side(rows), means(rows), by_threads(builds)):
        print_table(table)
        print()
    for row in rows:
        if not row["agrees"]:
            print(f"kilauea: warning: {disagreement(row)}", file=sys.stderr)
    return 0 if rows else 1


def check(args: argparse.Namespace) -> None:
    """Refuse what cannot be measured, before anything is loaded."""
    if bool(args.mesh) != bool(args.rays):
        raise UsageError("--mesh and --rays belong together")
    for name in ("n_rays", "rounds", "max_triangles"):
        if getattr(args, name) < 1:
            raise UsageError(f"--{name.replace('_', '-')} must be positive")
    if args.dump and not Path(args.dump).is_dir():
        raise UsageError(f"--dump: {args.dump} is no folder")


def embree_library() -> Path:
    """Return Embree's shared library, out of a package that is installed on first use.

    Raises
    ------
    KilaueaError
        The package cannot be installed, or has no library.
    """
    where = "import sysconfig; print(sysconfig.get_path('platlib'))"
    packages = Path(run_apart([str(EMBREE.python()), "-c", where], "find Embree").output.strip())
    found = sorted(packages.glob("embreex.libs/libembree4*"))
    if not found:
        raise KilaueaError(f"{EMBREE.package} {EMBREE.version} has no libembree4 in {packages}")
    return found[0]


def measure(
    loader: Callable[[], Any], dump: str | None, library: str, rounds: int, threads: list[int]
) -> dict[str, Any]:
    """Load a mesh and measure it; everything long can be interrupted."""
    engine = native()
    try:
        workload = interrupt.run(loader)
        if dump:
            workload.dump(dump)
        print(f"kilauea: {workload.name}: {workload.n_triangles} triangles", file=sys.stderr)
        return json.loads(interrupt.run(lambda: workload.measure(library, rounds, threads)))
    except (engine.RenderError, engine.SceneError) as error:
        raise KilaueaError(str(error)) from None


def mode(row: dict[str, Any]) -> str:
    """Return the last word of the peer's name: how it is built."""
    return row["peer_name"].rpartition(" ")[2]


def side_by_side(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give each kind of rays one line: ours, each mode of the peer, and the ratios."""
    lines: dict[tuple[str, str], dict[str, Any]] = defaultdict(dict)
    for row in rows:
        line = lines[row["mesh"], row["rays"]]
        line |= {key: row[key] for key in ("mesh", "triangles", "rays")}
        line |= {
            row["ours_name"]: row["ours"],
            mode(row): row["peer"],
            f"/{mode(row)}": row["ratio"],
        }
    return list(lines.values())


def means(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Geometric means of the ratios over meshes, for each kind of rays and for all."""
    ratios: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        for kind in (row["rays"], "all"):
            ratios[kind][f"{row['ours_name']}/{mode(row)}"].append(row["ratio"])
    kinds = [kind for kind in ratios if kind != "all"] + (["all"] if ratios else [])
    return [
        {"rays": kind} | {pair: geometric_mean(found) for pair, found in ratios[kind].items()}
        for kind in kinds
    ]


def by_threads(builds: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give each tree one line: its size, and seconds for each number of threads."""
    lines: dict[tuple[str, str], dict[str, Any]] = defaultdict(dict)
    for row in builds:
        line = lines[row["mesh"], row["builder"]]
        same = ("mesh", "triangles", "builder", "bytes_per_triangle")
        line |= {key: row[key] for key in same}
        line[f"threads={row['threads']}"] = row["seconds"]
    return list(lines.values())


def disagreement(row: dict[str, Any]) -> str:
    """Say how many rays two tracers answer differently."""
    return (
        f"{row['mesh']} {row['rays']}: {row['ours_name']} and {row['peer_name']} differ: of "
        f"{row['n_rays']} rays {row['hit_by_one']} hit for one of them, {row['other_distance']} "
        "hit elsewhere"
    )
