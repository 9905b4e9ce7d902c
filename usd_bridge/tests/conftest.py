from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from kilauea.payload import Frame


@pytest.fixture
def write_stage(tmp_path: Path) -> Callable[..., Path]:
    """Write a stage's text under a name and return the file."""

    def write(body: str, name: str = "stage.usda", header: str = "") -> Path:
        file = tmp_path / name
        # The format wants a prim's braces on lines of their own.
        lines = body.replace("{", "{\n").replace("}", "\n}\n").replace(";", "\n")
        file.write_text(f"#usda 1.0\n({header})\n{lines}\n")
        return file

    return write


@pytest.fixture
def flatten(write_stage: Callable[..., Path]) -> Callable[..., Frame]:
    """Flatten a stage given as text."""

    def run(body: str, header: str = "", **options: Any) -> Frame:
        from kilauea.usd.options import FlattenOptions
        from kilauea.usd.stage import flatten as flatten_file

        return flatten_file(str(write_stage(body, header=header)), FlattenOptions(**options))

    return run


def material_path(frame: Frame, index: int) -> str:
    return frame.materials[index]["path"]


def translation(matrix: Any) -> list[float]:
    return [float(c) for c in list(matrix)[12:15]]
