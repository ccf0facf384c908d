"""The origin of a channel: its role and column in the file, so that a message can give a complete remedy."""

from collections.abc import Mapping
from typing import NamedTuple

ROLES_OF_CHANNELS = {
    "motor_m": ("position",),
    "force_n": ("force", "current", "voltage"),
    "scale_m": ("scale",),
    "reference_m": ("reference",),
    "force_command_n": ("force_command",),
}
"""Field of a recording -> the roles that may fill it; the first one present is used."""


class ColumnOrigin(NamedTuple):
    """A column of the file, and its factor to SI."""

    column: str
    factor: float


def entry_of(
    origins: Mapping[str, ColumnOrigin], axis: str, channel: str, factor: float, source: str = ""
) -> str:
    """Return an entry of `--map` that scales the channel by `factor` relative to the present reading.

    `source`: the channel whose column is to be used instead, with its present factor.
    """
    role = _role(origins, channel)
    from_role = _role(origins, source or channel)
    origin = origins.get(from_role, ColumnOrigin("NAME", 1.0))
    return f"{axis}.{role}={origin.column}*{origin.factor * factor:.6g}"


def _role(origins: Mapping[str, ColumnOrigin], channel: str) -> str:
    roles = ROLES_OF_CHANNELS[channel]
    return next((role for role in roles if role in origins), roles[0])
