"""Sends a shot to an OpenCue farm: a frame of the farm is a frame of the shot.

    python pipeline/cluster/opencue.py shot.usda 'shot.$F4.exr' 1-100 -- -p 256 -c main_cam

Farms start again what fails, and a frame goes on from its journal: `--resume` with as many local
workers as asked for, so that a crash costs a worker and not the frame. Needs OpenCue's `outline`.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def main() -> None:
    """Build the job and launch it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("stage")
    parser.add_argument("output", help="with $F4, which stands for the frame")
    parser.add_argument("frames", help="as OpenCue has it: 1-100x2")
    parser.add_argument("--cores", type=int, default=8, help="of a host, for each frame")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("options", nargs="*", help="of kilauea render, after --")
    args = parser.parse_args()

    import outline
    import outline.cuerun
    from outline.modules.shell import Shell

    job = outline.Outline(f"kilauea_{Path(args.stage).stem}", frame_range=args.frames)
    job.add_layer(Shell("render", command=command(args), cores=args.cores, range=args.frames))
    outline.cuerun.launch(job, use_pycuerun=False)


def command(args: argparse.Namespace) -> list[str]:
    """Return what renders a frame; OpenCue puts its number in for `#IFRAME#`."""
    return [
        "kilauea", "render", args.stage, "-o", args.output, "-f", "#IFRAME#", "--resume",
        "--workers", str(args.workers), "-j", str(max(1, args.cores // args.workers)),
        *args.options,
    ]  # fmt: skip


if __name__ == "__main__":
    main()
