"""All scales of a bench in one compiled tick; their process objects and records are in shared arrays."""

from collections.abc import Sequence
from typing import Any

from hil_sim.config import Plant
from hil_sim.cyclic.scale_step import read_scales, scale_records
from hil_sim.scale.encoder_device import LinearScale
from hil_sim.scale.scale_objects import ScaleObjects
from kernels.arrays import Array


class BenchScales:
    """The scales of a plant; moves their process objects into `numbers` (scales, values)."""

    def __init__(self, scales: Sequence[LinearScale], plant: Plant, numbers: Array) -> None:
        self._scales, self._plant = tuple(scales), plant
        self._records = scale_records(len(scales))
        self._objects = numbers.view(ScaleObjects.record()).reshape(-1)
        for index, scale in enumerate(scales):
            scale.move_to(self._records[index : index + 1], numbers[index])

    @property
    def memory(self) -> tuple[Any, Any]:
        """Arguments of `serve_burst`, in its order."""
        return self._records, self._objects

    @property
    def without_cams(self) -> bool:
        """Whether no scale switches cams, so that the tick only reads the heads."""
        return not any(scale.has_cams for scale in self._scales)

    def read(self) -> None:
        """Read all heads and switch the cams."""
        read_scales(self._records, self._objects, self._plant.state)
        for scale in self._scales:
            scale.switch_cams()
