"""Renders stages with Kilauea and with Cycles and compares: `compare_with_cycles.py STAGE ...`.

Prints a row per stage and exits with 1 where the mean of any channel differs by more than the
tolerance. Everything after `--` goes to both renders.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any


def main() -> int:
    """Run the command."""
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stages", nargs="+", type=Path, metavar="STAGE")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the images")
    parser.add_argument("--tolerance", type=float, default=0.01, help="relative, of the mean")
    args = parser.parse_args(words[:split])
    args.out.mkdir(parents=True, exist_ok=True)
    failures = 0
    for stage in args.stages:
        try:
            found = compare(stage, args.out, words[split + 1 :])
        except subprocess.CalledProcessError as error:
            failures += 1
            print(f"{stage.name:32} FAILED  {error.stderr.strip().splitlines()[-1:]}")
            continue
        off = max(abs(ratio - 1.0) for ratio in found["mean_ratio"])
        failures += off > args.tolerance
        ratios = " ".join(f"{ratio:.4f}" for ratio in found["mean_ratio"])
        verdict = "ok" if off <= args.tolerance else "DIFFERS"
        print(f"{stage.name:32} {verdict:8} ratios {ratios}  relMSE {found['relMSE']:.3g}")
    return 1 if failures else 0


def compare(stage: Path, out: Path, flags: list[str]) -> dict[str, Any]:
    """Render a stage with both engines and return what `kilauea compare` finds."""
    ours, theirs = out / f"{stage.stem}.exr", out / f"{stage.stem}.cycles.exr"
    for command, image in (("render", ours), ("reference", theirs)):
        kilauea(command, str(stage), "-o", str(image), "-V", "0", *flags)
    return json.loads(kilauea("compare", str(ours), str(theirs)))


def kilauea(*words: str) -> str:
    """Run a Kilauea command and return what it printed."""
    command = [sys.executable, "-m", "kilauea.cli", *words]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    sys.exit(main())
