"""`kilauea bench`: speed and error, ours and others', as tables and JSON."""

from __future__ import annotations

import argparse

from kilauea.benchmarks import (
    error,
    ledger,
    load,
    needs,
    photons,
    rays,
    samples,
    sets,
    shading,
    workers,
)

SUBCOMMANDS = {
    "samples": (samples, "camera paths per second against Cycles and Mitsuba"),
    "rays": (rays, "rays per second on one thread against Embree, and building of trees"),
    "photons": (photons, "photons traced per second, and what their map takes"),
    "shading": (shading, "what shading as a dataflow costs, against a plain loop"),
    "sets": (sets, "what a scene asks of the members of a set that it is spread over"),
    "workers": (workers, "frames of N processes beside that of one, and their pixels"),
    "load": (load, "time and memory from the stage to the first ray, against Blender"),
    "needs": (needs, "what is saved by skipping what a stage has no use for"),
    "error": (error, "error at equal time against Cycles, Mitsuba and LuxCore"),
    "ledger": (ledger, "write what was measured into the documentation"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add a subcommand for each thing that is measured."""
    subparsers = parser.add_subparsers(required=True, metavar="WHAT")
    for name, (module, text) in SUBCOMMANDS.items():
        sub = subparsers.add_parser(name, help=text, description=text)
        module.add_arguments(sub)
        sub.set_defaults(measure=module.run)


def main(args: argparse.Namespace) -> int:
    """Run a subcommand and return its exit code."""
    return args.measure(args)
