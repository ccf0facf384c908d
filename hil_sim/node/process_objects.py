"""Process objects as plain integer attributes: the cycle reads and writes no dictionary.

A device declares a slotted dataclass whose fields name their CANopen object once:

    @dataclass(slots=True)
    class ScaleObjects(ProcessObjects):
        position_value: int = cia(0x6004)
"""

from dataclasses import dataclass, field, fields
from typing import Any, ClassVar


def cia(index: int, subindex: int = 0) -> Any:
    """Dataclass field bound to one object; its start value comes from the EDS."""
    return field(default=0, metadata={"object": (index, subindex)})


Address = tuple[int, int]
"""Index and subindex."""


@dataclass(slots=True)
class ProcessObjects:
    """The process objects of every device."""

    COMPUTED: ClassVar[dict[Address, str]] = {}
    """Objects that are properties: computed when they are asked for, not in every cycle."""

    error_register: int = cia(0x1001)


def attribute_names(objects: ProcessObjects | type[ProcessObjects]) -> dict[Address, str]:
    """Map (index, subindex) to the attribute that holds the object."""
    stored = {item.metadata["object"]: item.name for item in fields(objects) if "object" in item.metadata}
    return stored | objects.COMPUTED
