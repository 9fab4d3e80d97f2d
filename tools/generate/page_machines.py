"""What the page knows of machine profiles: those that come with WiFiCNC, and which setting each key of a profile is."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel
from wificnc.profile.load import find_machines, load_machine
from wificnc.profile.model import HOMING_ORDER, KINEMATICS, LinearAxis, Machine, RotaryAxis, Second

Json = dict[str, Any]


def machine_tables() -> Json:
    """Same profiles and model, same tables."""
    tables = {
        name: _model(field.annotation)
        for name, field in Machine.model_fields.items()
        if _model(field.annotation) is not None and name != "axis"
    }
    return {
        "machines": [_machine(name) for name in find_machines()],
        "keys": {
            **{name: _settings(model) for name, model in tables.items() if model is not None},
            "linear": _settings(LinearAxis),
            "rotary": _settings(RotaryAxis),
            "second": _settings(Second),
        },
        "kinematics": list(KINEMATICS),
        "homing_order": list(HOMING_ORDER),
    }


def _machine(name: str) -> Json:
    machine = load_machine(name)
    return {"id": name, "name": machine.name, "values": {str(n): text for n, text in machine.settings_texts().items()}}


def _model(annotation: Any) -> type[BaseModel] | None:
    return annotation if isinstance(annotation, type) and issubclass(annotation, BaseModel) else None


def _settings(model: type[BaseModel]) -> Json:
    """Key -> name of the setting; "": more than one setting, or a bit of one. With what every machine must say."""
    keys = {}
    for name, field in model.model_fields.items():
        extra = field.json_schema_extra
        keys[name] = str(extra["setting"]) if isinstance(extra, dict) else ""
    return {"keys": keys, "needed": [name for name, field in model.model_fields.items() if field.is_required()]}
