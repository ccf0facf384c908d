"""Process objects as integer attributes in one array: the cycle reads and writes no dictionary.

A device declares a class whose attributes name their CANopen object once:

    class ScaleObjects(ProcessObjects):
        position_value: int = cia(0x6004)

The values are consecutive float64, which hold every value exactly, so that the compiled cycle can access them
by name in a structured view of the same array.
"""

from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array

Address = tuple[int, int]
"""Index and subindex."""


class ObjectValue:
    """The attribute of one object."""

    def __init__(self, address: Address, place: int = 0) -> None:
        self.address, self.place = address, place

    def __get__(self, objects: "ProcessObjects | None", _owner: type) -> Any:
        return self if objects is None else int(objects.memory[self.place])

    def __set__(self, objects: "ProcessObjects", value: float) -> None:
        objects.memory[self.place] = value


class FractionalValue(ObjectValue):
    """The attribute of an object whose value inside the device need not be an integer."""

    def __get__(self, objects: "ProcessObjects | None", _owner: type) -> Any:
        return self if objects is None else objects.memory[self.place]


def cia(index: int, subindex: int = 0) -> Any:
    """Declare an attribute for one object; its default comes from the EDS."""
    return ObjectValue((index, subindex))


class ProcessObjects:
    """The process objects of every device."""

    COMPUTED: ClassVar[dict[Address, str]] = {}
    """Objects that are properties: computed at an access, not in every cycle."""
    VALUES: ClassVar[dict[str, ObjectValue]] = {}
    """The other objects by attribute, in the order of their places in the array."""

    error_register: int = cia(0x1001)

    def __init_subclass__(cls) -> None:
        classes = reversed(cls.__mro__)
        named = (item for each in classes for item in vars(each).items())
        cls.VALUES = {name: value for name, value in named if isinstance(value, ObjectValue)}
        for place, value in enumerate(cls.VALUES.values()):
            value.place = place

    def __init__(self) -> None:
        self.move_to(np.zeros(len(self.VALUES)))

    def move_to(self, numbers: Array) -> None:
        """Keep the values in this array (values,) from now on; they have its present contents."""
        self.numbers = numbers
        self.memory: Any = numbers.data

    @classmethod
    @cache  # one object for each class: a call of a kernel looks up its type by it
    def record(cls) -> np.dtype[Any]:
        """Return the layout of the array, by the names of the attributes."""
        return np.dtype([(name, np.float64) for name in cls.VALUES])

    @property
    def records(self) -> NDArray[Any]:
        """The array as one record (1,), by the names of the attributes."""
        return self.numbers.view(self.record())


def attribute_names(objects: ProcessObjects | type[ProcessObjects]) -> dict[Address, str]:
    """Map (index, subindex) to the attribute that holds the object."""
    return {value.address: name for name, value in objects.VALUES.items()} | objects.COMPUTED
