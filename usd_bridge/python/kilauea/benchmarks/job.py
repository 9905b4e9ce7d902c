"""A stage at fixed settings, flattened once for all engines that render it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilauea.reference import export_frame
from kilauea.render import RenderOptions

_HOW_NOT_WHAT = ("samples_per_pixel", "seed", "threads", "time_limit_secs")
"""Settings that do not change the converged image."""
_HOW_NOT_WHAT_OF_PHOTONS = ("aim", "split")
"""The same of those about photons."""


@dataclass(frozen=True, slots=True)
class Job:
    """What is rendered."""

    stage: str
    folder: Path
    """The exported scene; images go beside it."""
    settings: dict[str, Any]
    camera: str | None = None
    """Prim path, or the name of a camera; None is the stage's own choice."""
    flags: tuple[str, ...] = ()
    """Further words of `kilauea render` that the export was made with."""

    @classmethod
    def prepare(
        cls,
        stage: str,
        folder: Path,
        settings: dict[str, Any],
        image_width: int | None = None,
        materials: bool = True,
        camera: str | None = None,
    ) -> Job:
        """Flatten and export a stage; `settings` stand over those of the stage.

        Parameters
        ----------
        image_width
            In pixels; the height follows from the camera's aperture.
        materials
            False renders every surface as if nothing were bound to it.
        camera
            Prim path, or the name of a camera.
        """
        from kilauea.usd.options import FlattenOptions
        from kilauea.usd.stage import flatten

        folder.mkdir(parents=True)
        resolution = settings.get("resolution")
        options = FlattenOptions(
            camera=camera,
            resolution=tuple(resolution) if resolution else None,
            image_width=image_width,
            scene_materials=materials,
        )
        render_options = RenderOptions([], settings)
        exported = export_frame(flatten(stage, options), render_options, folder)
        flags = () if materials else ("--disable-scene-materials",)
        flags += ("--camera", camera) if camera else ()
        return cls(stage, folder, exported, camera, flags)

    @property
    def name(self) -> str:
        """The stage as tables call it, with the camera where one was chosen."""
        return name_of(self.stage, self.camera)

    @property
    def n_pixels(self) -> int:
        """Pixels of the image."""
        width, height = self.settings["resolution"]
        return width * height

    def content_hash(self) -> str:
        """Digest all that decides what the image converges to."""
        record = json.loads((self.folder / "scene.json").read_text(encoding="utf-8"))
        for name in _HOW_NOT_WHAT:
            record["settings"].pop(name, None)
        for name in _HOW_NOT_WHAT_OF_PHOTONS:
            record["settings"]["photons"].pop(name, None)
        digest = hashlib.sha256(json.dumps(record, sort_keys=True).encode())
        for file in sorted(self.folder.glob("*")):
            if file.suffix not in (".json", ".exr"):
                digest.update(file.name.encode() + b"\0" + file.read_bytes())
        return digest.hexdigest()


def name_of(stage: str, camera: str | None) -> str:
    """Return what tables call a stage, seen by its own camera or by another one of it."""
    name = Path(stage).stem
    return f"{name}-{camera.rpartition('/')[2]}" if camera else name
