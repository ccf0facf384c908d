"""Reads plant.toml into a PlantConfig; every error names the file and the key."""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hil_sim.config.checks import problems_between, problems_of
from hil_sim.config.model import PlantConfig
from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import EFFECTS, of_kind
from hil_sim.plant import amplifier
from kernels.quantities import AXIS, fields_of, section_of
from kernels.validation_messages import plain_message

SENSORS = {section_of(module) for module in of_kind(Kind.SENSOR)}
"""Effects whose sections (encoder, scale) also have other keys, so that `model` declares them."""
EFFECT_PARAMS = {section_of(module): module.Params for module in EFFECTS if section_of(module) not in SENSORS}
NO_OTHER_AXES: Mapping[str, int] = {}
MOTIONS = ("linear", "rotary")
"""Values of `motion`. The laws are equal for both: on a rotary axis 1 m stands for 1 rad, 1 N for 1 N m."""
FORMAT = 1
"""Format number of plant files; it rises when a key changes its meaning."""


class ConfigError(Exception):
    """A file that cannot be used; names the file, the key and the reason in one line for the user."""

    def __init__(self, file: Path, key: str, reason: str) -> None:
        super().__init__(f"{file}: {key}: {reason}" if key else f"{file}: {reason}")
        self.file = file
        self.key = key
        self.reason = reason


OTHER_FILE_KINDS = {"machine": "a controller file", "bus": "a controller file", "step": "a program"}
"""Kinds of other files, by a section that a plant file never has."""


def load_plant(path: Path) -> PlantConfig:
    """Read a plant file, or the `plant.toml` of a machine's directory.

    Raises:
        ConfigError: the file cannot be read, or a key is unknown, missing or out of bounds.

    """
    file = path / "plant.toml" if path.is_dir() else path
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(file, "", error.strerror or "cannot be read") from error
    except (ValueError, RecursionError) as error:  # no UTF-8, no TOML, a huge number, too deep nesting
        raise ConfigError(file, "", f"not TOML: {error}") from error
    _check_format(file, content.pop("format", None))
    plant = _table(file, "plant", content.pop("plant", {}))
    axes = _table(file, "axis", content.pop("axis", {}))
    for key in content:
        if key in OTHER_FILE_KINDS:
            raise ConfigError(
                file, "", f"this is {OTHER_FILE_KINDS[key]}, --machine takes a directory with plant.toml"
            )
        raise ConfigError(file, key, "unknown key")
    numbers = {name: number for number, name in enumerate(axes)}
    plant["axes"] = {name: _axis(file, name, table, numbers) for name, table in axes.items()}
    try:
        config = PlantConfig.model_validate(plant)
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigError(file, _key_of(first["loc"]), plain_message(first["msg"])) from error
    for name, axis in config.axes.items():
        for section, reason in problems_of(axis, config.dt_s):
            raise ConfigError(file, f"axis.{name}.{section}", reason)
    for name, section, reason in problems_between(config.axes):
        raise ConfigError(file, f"axis.{name}.{section}", reason)
    return config


def _check_format(file: Path, found: object) -> None:
    """Refuse another format number; a file without the key has the first format."""
    if found is not None and (type(found) is not int or found != FORMAT):
        raise ConfigError(
            file,
            "format",
            f"is {found!r}, this hil-sim reads {FORMAT}: update it, or use the one that wrote the file",
        )


def _key_of(location: tuple[int | str, ...]) -> str:
    """Return the key in the file for the location of an error in pydantic's model."""
    parts = [str(part) for part in location]
    if parts[:1] == ["axes"]:
        return ".".join(["axis", *parts[1:]])
    return ".".join(["plant", *parts])


def _table(file: Path, key: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ConfigError(file, key, "must be a table")
    return dict(value)


def _axis(file: Path, own_name: str, value: Any, numbers: dict[str, int]) -> dict[str, Any]:
    """Return the table of an axis with effects and amplifier as `Params`, and absolute paths of EDS files."""
    key = f"axis.{own_name}"
    axis = _table(file, key, value)
    if (motion := axis.pop("motion", MOTIONS[0])) not in MOTIONS:
        raise ConfigError(file, f"{key}.motion", f"{motion!r} is neither of {', '.join(MOTIONS)}")
    others = {name: number for name, number in numbers.items() if name != own_name}
    axis["effects"] = {
        name: read_params(file, f"{key}.{name}", params, axis.pop(name), others)
        for name, params in EFFECT_PARAMS.items()
        if name in axis
    }
    if "amplifier" in axis:
        axis["amplifier"] = read_params(file, f"{key}.amplifier", amplifier.Params, axis["amplifier"])
    for section in ("drive", "scale"):
        if isinstance(axis.get(section), dict) and isinstance(axis[section].get("eds"), str):
            axis[section] = {**axis[section], "eds": (file.parent / axis[section]["eds"]).resolve()}
    drive = axis.get("drive")
    personality = drive.get("personality") if isinstance(drive, dict) else None
    if (
        isinstance(drive, dict)
        and isinstance(personality, dict)
        and isinstance(personality.get("inside_eds"), str)
    ):
        inside_eds = (file.parent / personality["inside_eds"]).resolve()
        axis["drive"] = {**drive, "personality": {**personality, "inside_eds": inside_eds}}
    return axis


def read_params(
    file: Path, key: str, params: type[Any], value: Any, others: Mapping[str, int] = NO_OTHER_AXES
) -> Any:
    """Return a TOML table as an effect's `Params` in SI; `others` holds the indices of the other axes.

    Raises:
        ConfigError: a key is unknown, missing or out of bounds.

    """
    table = _table(file, key, value)
    values: dict[str, Any] = {}
    for field in fields_of(params):
        if field.key not in table:
            if field.name in params._field_defaults:
                continue
            raise ConfigError(file, f"{key}.{field.key}", "missing")
        given = table.pop(field.key)
        field_key = f"{key}.{field.key}"
        length = field.quantity.length
        if field.quantity.file_unit == AXIS:
            values[field.name] = _axis_index(file, field_key, given, others)
        elif length:
            if not isinstance(given, list) or len(given) > length:
                raise ConfigError(file, field_key, f"must be a list of at most {length} numbers")
            numbers = [_number(file, field_key, item, field.quantity) for item in given]
            values[field.name] = tuple(numbers + [0.0] * (length - len(numbers)))
        else:
            values[field.name] = _number(file, field_key, given, field.quantity)
    for unknown in table:
        raise ConfigError(file, f"{key}.{unknown}", "unknown key")
    return params(**values)


def _axis_index(file: Path, key: str, given: Any, others: Mapping[str, int]) -> float:
    if not isinstance(given, str) or given not in others:
        raise ConfigError(
            file, key, f"must be the name of another axis: {', '.join(others) or 'there is none'}"
        )
    return float(others[given])


def _number(file: Path, key: str, given: Any, quantity: Any) -> float:
    if isinstance(given, bool) or not isinstance(given, (int, float)) or not math.isfinite(given):
        raise ConfigError(file, key, f"must be a number, not {given!r}")
    value: float = quantity.to_si(float(given))
    if not quantity.lower <= value <= quantity.upper:
        low, high = quantity.from_si(quantity.lower), quantity.from_si(quantity.upper)
        unit = quantity.file_unit or quantity.unit
        raise ConfigError(file, key, f"{given:g} is not within {low:g} to {high:g} {unit}".rstrip())
    return value
