"""Changes to an open stage, which no file ever sees: they are opinions of its session layer."""

from __future__ import annotations

import json

from pxr import Sdf, Tf, Usd

from kilauea.errors import UsageError

_MAX_SHOWN = 400
"""Characters of a value: arrays may be of millions."""


def value_text(stage: Usd.Stage, name: str) -> str:
    """Return an attribute's value as text, its earliest if it changes; long ones are cut.

    Raises
    ------
    UsageError
        The stage has no such attribute.
    """
    value = _attribute(stage, name).Get(Usd.TimeCode.EarliestTime())
    text = "no value" if value is None else str(value)
    return text if len(text) <= _MAX_SHOWN else text[:_MAX_SHOWN] + " ..."


def set_value(stage: Usd.Stage, name: str, text: str) -> None:
    """Set an attribute for all times to a value written as in USD files; words need no quotes.

    Raises
    ------
    UsageError
        The stage has no such attribute, another gives it its value, or the text is none.
    """
    attribute = _attribute(stage, name)
    if attribute.HasAuthoredConnections():
        sources = ", ".join(str(path) for path in attribute.GetConnections())
        raise UsageError(f"{name} has its value from {sources}")
    value = _parsed(name, attribute.GetTypeName(), text)
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        attribute.Set(value)


def _attribute(stage: Usd.Stage, name: str) -> Usd.Attribute:
    is_path = Sdf.Path.IsValidPathString(name)
    path = Sdf.Path(name) if is_path else Sdf.Path.emptyPath
    if not path.IsAbsolutePath() or not path.IsPropertyPath():
        raise UsageError(f"{name!r} is not PRIM.ATTRIBUTE, such as /World/Key.inputs:intensity")
    attribute = stage.GetAttributeAtPath(path)
    if not attribute:
        raise UsageError(f"the stage has no attribute {name}")
    return attribute


def _parsed(name: str, type_name: Sdf.ValueTypeName, text: str) -> object:
    """Let USD read the value, which knows the syntax of all types."""
    if type_name in (Sdf.ValueTypeNames.Token, Sdf.ValueTypeNames.String):
        written = text if text.startswith(('"', "'")) else json.dumps(text)
    elif type_name == Sdf.ValueTypeNames.Asset:
        written = text if text.startswith("@") else f"@{text}@"
    else:
        written = text
    layer = Sdf.Layer.CreateAnonymous(".usda")
    prim = f'#usda 1.0\nover "prim"\n{{\n    custom {type_name} value = {written}\n}}\n'
    try:
        spec = layer.GetAttributeAtPath("/prim.value") if layer.ImportFromString(prim) else None
    except Tf.ErrorException:
        spec = None
    if spec is None or spec.default is None:
        raise UsageError(f"{name}: {text!r} is not of type {type_name}")
    return spec.default
