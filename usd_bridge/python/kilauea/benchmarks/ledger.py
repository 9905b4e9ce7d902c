"""`kilauea bench ledger`: writes what was measured into the documentation.

A page has sections between `<!-- ledger NAME -->` and `<!-- end NAME -->`; what stands outside of
them is for people to write. The figures come from the JSON that the other subcommands write, which
lies beside the documentation. A section stays as it is where there is no file for it.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kilauea.benchmarks import equal_time, error_tables, plot, speed_tables
from kilauea.benchmarks.report import read_json
from kilauea.errors import KilaueaError
from kilauea.output import write_text

Report = dict[str, Any]

SECTIONS: dict[str, tuple[str, Callable[[Report], str]]] = {
    "sentence": ("error", error_tables.sentence),
    "headline": ("error", error_tables.headline),
    "equal-time": ("error", equal_time.ratios),
    "error": ("error", error_tables.comparison),
    "references": ("error", error_tables.references),
    "not-expressed": ("error", error_tables.not_expressed),
    "samples": ("samples", speed_tables.samples),
    "load": ("load", speed_tables.load),
    "rays": ("rays", speed_tables.rays),
}
"""The report and the text of each section, by name."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("--docs", type=Path, default=Path("docs"), metavar="FOLDER")


def run(args: argparse.Namespace) -> int:
    """Rewrite the sections of all pages, and the plot."""
    reports = read_reports(args.docs / "ledger")
    for page in (args.docs / "benchmarks.md", args.docs.parent / "README.md"):
        text = page.read_text(encoding="utf-8")
        write_text(page, rewritten(text, reports, str(page)))
    if "error" in reports:
        plot.write(reports["error"]["rows"], args.docs / "images" / "error-against-time")
    return 0


def read_reports(folder: Path) -> dict[str, Report]:
    """Read what was measured, by the name of the subcommand.

    Raises
    ------
    KilaueaError
        There is no such folder, or a file is no report.
    """
    if not folder.is_dir():
        raise KilaueaError(f"{folder} does not exist: it holds what `kilauea bench` measured")
    return {file.stem: read_json(file) for file in sorted(folder.glob("*.json"))}


def rewritten(text: str, reports: dict[str, Report], page: str) -> str:
    """Return a page with the sections of all reports that there are.

    Raises
    ------
    KilaueaError
        A section has no end, or a name that means nothing.
    """

    def section(found: re.Match[str]) -> str:
        name, old = found["name"], found["body"]
        if name not in SECTIONS:
            raise KilaueaError(f"{page}: no section is called {name}")
        source, write = SECTIONS[name]
        body = f"\n{write(reports[source]).strip()}\n" if source in reports else old
        return f"<!-- ledger {name} -->{body}<!-- end {name} -->"

    pattern = r"<!-- ledger (?P<name>[\w-]+) -->(?P<body>.*?)<!-- end (?P=name) -->"
    written, n_sections = re.subn(pattern, section, text, flags=re.DOTALL)
    if n_sections != text.count("<!-- ledger "):
        raise KilaueaError(f"{page}: a section has no end")
    return written
