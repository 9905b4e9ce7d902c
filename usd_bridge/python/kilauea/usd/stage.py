"""From a stage on disk to one frame for the engine."""

from __future__ import annotations

import dataclasses
from typing import Any

from pxr import Gf, Sdf, Tf, Usd

from kilauea import payload
from kilauea.errors import StageError
from kilauea.usd import camera as cameras
from kilauea.usd import edits, instancing, settings
from kilauea.usd.bindings import Bindings
from kilauea.usd.context import Context, Inherited, Space
from kilauea.usd.diagnostics import captured, composition_report, error_line
from kilauea.usd.lights import LightTable
from kilauea.usd.materials import MaterialTable
from kilauea.usd.motion import MotionSampler
from kilauea.usd.options import FlattenOptions
from kilauea.usd.textures import TextureTable
from kilauea.usd.traversal import Traversal

DEFAULT_LIGHT = "<default light>"


def flatten(path: str, options: FlattenOptions | None = None) -> payload.Frame:
    """Open a stage and flatten it at one time code.

    Raises
    ------
    StageError
        The stage cannot be opened.
    UsageError
        A camera or settings prim that was asked for is not in the stage.
    """
    options = options or FlattenOptions()
    return SourceStage(path, options.mask).flatten(options)


class SourceStage:
    """An open stage, from which frames are taken."""

    def __init__(self, path: str, mask: tuple[str, ...] = ()) -> None:
        self.path = path
        remarks: list[str] = []
        try:
            with captured(remarks):
                self._stage = _open(path, mask)
        except Tf.ErrorException as error:
            raise StageError(f"cannot open stage {path}: {error_line(error)}") from None
        self._missing, self._warnings = composition_report(self._stage)
        self._notes = _notes(remarks, self._missing, self._warnings)

    @property
    def frames_per_second(self) -> float:
        """Frames per second of playback."""
        return float(self._stage.GetFramesPerSecond())

    @property
    def start_time(self) -> float:
        """Return the first time code of the stage's range, 0 without a range."""
        authored = self._stage.HasAuthoredTimeCodeRange()
        return float(self._stage.GetStartTimeCode()) if authored else 0.0

    def product_name(self, options: FlattenOptions) -> str:
        """Return the file that the settings' product names; empty where there is none."""
        time = self._time(options)
        return settings.read(self._stage, options, Usd.TimeCode(time)).product_name

    def flatten(self, options: FlattenOptions) -> payload.Frame:
        """Flatten the stage at the options' time code."""
        time = self._time(options)
        options = dataclasses.replace(options, time=time)
        frame = payload.Frame(
            self.path,
            time,
            warnings=list(self._warnings),
            notes=list(self._notes),
            missing=list(self._missing),
        )
        try:
            with captured(frame.notes):
                self._fill(frame, options)
        except Tf.ErrorException as error:
            raise StageError(f"cannot read stage {self.path}: {error_line(error)}") from None
        return frame

    def value_text(self, name: str) -> str:
        """Return the value of PRIM.ATTRIBUTE as text."""
        return edits.value_text(self._stage, name)

    def set_value(self, name: str, text: str) -> None:
        """Set PRIM.ATTRIBUTE on this stage, in none of its files."""
        edits.set_value(self._stage, name, text)

    def reload(self) -> None:
        """Read the stage's files again. What was set stays."""
        remarks: list[str] = []
        with captured(remarks):
            self._stage.Reload()
        self._missing, self._warnings = composition_report(self._stage)
        self._notes = _notes(remarks, self._missing, self._warnings)

    def _time(self, options: FlattenOptions) -> float:
        return self.start_time if options.time is None else options.time

    def _fill(self, frame: payload.Frame, options: FlattenOptions) -> None:
        stage, time = self._stage, Usd.TimeCode(frame.time)
        spec = settings.read(stage, options, time)
        camera = cameras.choose(stage, spec, time)
        textures = TextureTable(frame, options)
        cx = Context(
            stage=stage,
            frame=frame,
            time=time,
            options=options,
            purposes=spec.purposes,
            bindings=Bindings(spec.material_purposes, options.scene_materials),
            materials=MaterialTable(frame, options, textures),
            lights=LightTable(frame, options, textures),
            motion=MotionSampler(frame.time, cameras.shutter(camera, spec, time)),
        )
        world = cx.spaces["world"] = Space(payload.WORLD, stage.GetPseudoRoot())
        roots = stage.GetPseudoRoot().GetFilteredChildren(Usd.TraverseInstanceProxies())
        Traversal(cx).run(roots, Inherited(Gf.Matrix4d(1)), world)
        instancing.LightPlacement(cx).place(payload.WORLD, Gf.Matrix4d(1))
        cx.lights.finish()
        textures.finish()
        frame.missing += cx.bindings.dangling()

        if options.image_width:
            settings.set_image_width(spec, options.image_width, camera)
        frame.camera = cameras.record(cx, spec, camera)
        frame.settings = spec.record()
        frame.warnings += [*spec.warnings, *cx.notes.lines()]
        if not frame.lights and (camera is None or not _emits(frame)):
            frame.lights.append(_default_light())
            frame.notes.append("the stage has no light: lit by a white dome of radiance 1")


def _open(path: str, mask: tuple[str, ...]) -> Usd.Stage:
    if not mask:
        return Usd.Stage.Open(path, Usd.Stage.LoadAll)
    for prim_path in mask:
        if not Sdf.Path.IsValidPathString(prim_path) or not prim_path.startswith("/"):
            raise StageError(f"{prim_path} is not a prim path")
    stage = Usd.Stage.OpenMasked(path, Usd.StagePopulationMask(mask), Usd.Stage.LoadAll)
    stage.ExpandPopulationMask()
    return stage


def _notes(remarks: list[str], *reported: list[str]) -> list[str]:
    """Return what USD remarked and no report says."""
    lines = [line for report in reported for line in report]
    return [remark for remark in remarks if not any(line in remark for line in lines)]


def _emits(frame: payload.Frame) -> bool:
    """Return whether any material may emit light."""
    for material in frame.materials:
        emissive = material["inputs"].get("emissiveColor")
        if emissive is None:
            continue
        node: dict[str, Any] = material["nodes"][emissive["node"]]
        if node["type"] != "constant" or any(node["value"][:3]):
            return True
    return False


def _default_light() -> dict[str, Any]:
    return {
        "path": DEFAULT_LIGHT,
        "shape": {"type": "dome"},
        "world_from_light": list(payload.IDENTITY),
        "radiance": [1.0, 1.0, 1.0],
        "texture": None,
        "diffuse": 1.0,
        "specular": 1.0,
        "shaping": None,
        "visible_to_camera": False,
    }
