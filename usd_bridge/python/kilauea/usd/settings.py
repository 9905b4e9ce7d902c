"""UsdRenderSettings, its product and its vars: what image is asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from pxr import Usd, UsdGeom, UsdRender

from kilauea import aovs
from kilauea.errors import UsageError
from kilauea.usd.options import FlattenOptions

DEFAULT_RESOLUTION = (640, 360)
"""Of stages without settings, as in `kilauea_scene::RenderSettings`."""

_ENGINE_ATTRIBUTES = {
    "kilauea:samplesPerPixel": "samples_per_pixel",
    "kilauea:maxDepth": "max_depth",
    "kilauea:seed": "seed",
    "kilauea:filter": "filter",
    "kilauea:filterRadius": "filter_radius",
}


@dataclass(slots=True)
class RenderSpec:
    """The settings, with a product's opinions over them and the command line's over both."""

    camera: str | None = None
    resolution: tuple[int, int] = DEFAULT_RESOLUTION
    pixel_aspect_ratio: float = 1.0
    conform_policy: str = "expandAperture"
    data_window_ndc: tuple[float, ...] = (0.0, 0.0, 1.0, 1.0)
    """(left, bottom, right, top), from the lower left."""
    purposes: frozenset[str] = frozenset(("default", "render"))
    material_purposes: tuple[str, ...] = ("full", "")
    motion_blur: bool = True
    depth_of_field: bool = True
    product_name: str = ""
    aovs: list[str] = field(default_factory=list)
    engine: dict[str, Any] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def record(self) -> dict[str, Any]:
        """Return the fields of `kilauea_scene::RenderSettings` that the stage decides."""
        record: dict[str, Any] = {
            **self.engine,
            "resolution": list(self.resolution),
            "pixel_aspect_ratio": self.pixel_aspect_ratio,
        }
        window = data_window(self.data_window_ndc, self.resolution)
        if window["min"] != [0, 0] or window["max"] != list(self.resolution):
            record["data_window"] = window
        if self.aovs:
            record["aovs"] = self.aovs
        return record


def read(stage: Usd.Stage, options: FlattenOptions, time: Usd.TimeCode) -> RenderSpec:
    """Read the chosen settings prim, or defaults, and apply the command line's overrides."""
    spec = RenderSpec()
    settings = _find(stage, options)
    if settings:
        _read_base(spec, settings, time, authored_only=False)
        spec.purposes = frozenset(settings.GetIncludedPurposesAttr().Get(time)) | {"default"}
        spec.material_purposes = tuple(settings.GetMaterialBindingPurposesAttr().Get(time))
        _read_engine(spec, settings.GetPrim(), time)
        _read_product(spec, settings, time)
    if options.purposes is not None:
        spec.purposes = options.purposes | {"default"}
    spec.camera = options.camera or spec.camera
    spec.motion_blur = spec.motion_blur and options.motion_blur
    spec.depth_of_field = spec.depth_of_field and options.depth_of_field
    spec.pixel_aspect_ratio = options.pixel_aspect_ratio or spec.pixel_aspect_ratio
    width, height = options.resolution or spec.resolution
    if min(width, height) < 1:
        raise UsageError(f"resolution {width} x {height} has no pixels")
    scale = options.resolution_scale
    spec.resolution = (max(1, round(width * scale)), max(1, round(height * scale)))
    return spec


def set_image_width(spec: RenderSpec, width: int, camera: UsdGeom.Camera | None) -> None:
    """Choose the height that shows the whole aperture at this width."""
    aspect = 20.955 / 15.2908
    if camera:
        aspect = camera.GetHorizontalApertureAttr().Get() / camera.GetVerticalApertureAttr().Get()
    spec.resolution = (width, max(1, round(width * spec.pixel_aspect_ratio / aspect)))


def data_window(ndc: tuple[float, ...], resolution: tuple[int, int]) -> dict[str, list[int]]:
    """Return the pixels whose centre is inside, y down; `max` is one past the last."""
    width, height = resolution
    left, bottom, right, top = (
        math.ceil(edge * n - 0.5) for edge, n in zip(ndc, (width, height) * 2, strict=True)
    )
    return {"min": [left, height - top], "max": [right, height - bottom]}


def _find(stage: Usd.Stage, options: FlattenOptions) -> UsdRender.Settings | None:
    if options.settings:
        settings = UsdRender.Settings.Get(stage, options.settings)
        if not settings:
            raise UsageError(f"{options.settings} is not a RenderSettings prim")
        return settings
    return UsdRender.Settings.GetStageRenderSettings(stage) or None


def _read_base(
    spec: RenderSpec, base: UsdRender.SettingsBase, time: Usd.TimeCode, authored_only: bool
) -> None:
    """Read what settings and products share; a product overrides by authored values only."""

    def get(attribute: Usd.Attribute, current: Any) -> Any:
        if authored_only and not attribute.HasAuthoredValue():
            return current
        value = attribute.Get(time)
        return current if value is None else value

    spec.resolution = tuple(get(base.GetResolutionAttr(), spec.resolution))
    spec.pixel_aspect_ratio = float(get(base.GetPixelAspectRatioAttr(), spec.pixel_aspect_ratio))
    spec.conform_policy = str(get(base.GetAspectRatioConformPolicyAttr(), spec.conform_policy))
    spec.data_window_ndc = tuple(get(base.GetDataWindowNDCAttr(), spec.data_window_ndc))
    spec.motion_blur = not get(base.GetDisableMotionBlurAttr(), not spec.motion_blur)
    spec.depth_of_field = not get(base.GetDisableDepthOfFieldAttr(), not spec.depth_of_field)
    cameras = base.GetCameraRel().GetForwardedTargets()
    if cameras:
        spec.camera = str(cameras[0])


def _read_product(spec: RenderSpec, settings: UsdRender.Settings, time: Usd.TimeCode) -> None:
    """Read the first raster product; the engine writes one image at a time."""
    stage = settings.GetPrim().GetStage()
    chosen = None
    for path in settings.GetProductsRel().GetForwardedTargets():
        product = UsdRender.Product.Get(stage, path)
        if not product:
            spec.warnings.append(f"{path} is not a RenderProduct")
        elif product.GetProductTypeAttr().Get(time) != UsdRender.Tokens.raster:
            product_type = product.GetProductTypeAttr().Get(time)
            spec.warnings.append(f"{path}: {product_type} products are not rendered yet")
        elif chosen:
            spec.warnings.append(f"{path} is not rendered: {chosen.GetPath()} is the product")
        else:
            chosen = product
    if chosen is None:
        return
    _read_base(spec, chosen, time, authored_only=True)
    spec.product_name = str(chosen.GetProductNameAttr().Get(time) or "")
    for path in dict.fromkeys(chosen.GetOrderedVarsRel().GetForwardedTargets()):
        _read_var(spec, UsdRender.Var.Get(stage, path), str(path), time)


def _read_var(spec: RenderSpec, var: UsdRender.Var, path: str, time: Usd.TimeCode) -> None:
    if not var:
        spec.warnings.append(f"{path} is not a RenderVar")
        return
    source = str(var.GetSourceNameAttr().Get(time) or "")
    driver = var.GetPrim().GetAttribute("driver:parameters:aov:name")
    names = [source, str(driver.Get(time) or "") if driver else ""]
    source_type = var.GetSourceTypeAttr().Get(time)
    aov = next(filter(None, map(aovs.canonical, names)), None)
    if aov is None:
        spec.warnings.append(f"{path}: {source_type} source {source!r} is not rendered yet")
    elif aov not in spec.aovs:
        spec.aovs.append(aov)


def _read_engine(spec: RenderSpec, prim: Usd.Prim, time: Usd.TimeCode) -> None:
    for name, key in _ENGINE_ATTRIBUTES.items():
        attribute = prim.GetAttribute(name)
        if attribute and attribute.HasAuthoredValue():
            spec.engine[key] = attribute.Get(time)
