"""Memory of the compiled cycle for all axes, allocated once; `step` calls the compiled cycle."""

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from kernels.jit import ready_for
from kernels.record_layout import store
from servo_ctrl.axis.axis_parts import output_places
from servo_ctrl.canopen.pdo import PdoCodec
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import AxisParts, cycle_records
from servo_ctrl.cyclic.axis_step import AXIS_COLUMNS, MACHINE_COLUMNS, REFERENCE_COLUMNS, step_axes
from servo_ctrl.cyclic.axis_supervision import begin_watch
from servo_ctrl.cyclic.contour_coupling import Coupling, contour_records

PDO_BYTES = 8
"""Bytes reserved for each PDO: the most that a CAN frame carries."""


class CycleMemory:
    """Holds the axis records, the `inputs` TPDOs of a cycle, and its outputs; `rpdos`: codecs by axis.

    `couplings`: pairs of axes under contour control. The constructor compiles the kernels, which takes
    seconds, or loads them, so that the first SYNC does not wait.

    Raises:
        PdoTypeError: an object of an RPDO is not an integer.

    """

    def __init__(
        self,
        parts: Sequence[AxisParts],
        rpdos: Sequence[Sequence[PdoCodec]],
        inputs: int,
        couplings: Sequence[Coupling] = (),
    ) -> None:
        count = len(parts)
        self._contours = contour_records(couplings)
        self.axes, self._tables, pool = cycle_records(parts)
        self.row: Array = np.full(MACHINE_COLUMNS + count * AXIS_COLUMNS, math.nan)
        """The recorded row of the last cycle."""
        self._params = [part.params for part in parts]
        codecs = [(axis, codec) for axis, axis_rpdos in enumerate(rpdos) for codec in axis_rpdos]
        axis_of: Index = np.array([axis for axis, _codec in codecs], np.int64)
        outputs: Index = np.stack([output_places(codec) for _axis, codec in codecs])
        self._inputs = np.zeros((inputs, PDO_BYTES), np.uint8)
        self._received: NDArray[np.bool_] = np.zeros(inputs, np.bool_)
        self._reference: Array = np.zeros(count * REFERENCE_COLUMNS)
        self._payloads = np.zeros((len(codecs), PDO_BYTES), np.uint8)
        self._input_bytes = self._inputs.reshape(-1).data
        self._received_bytes = self._received.view(np.uint8).data
        self._reference_bytes = self._reference.view(np.uint8).data
        self._put_reference = struct.Struct(f"@{len(self._reference)}d").pack_into
        self._spans = [
            slice(start, start + codec.size)
            for start, (_axis, codec) in zip(range(0, self._payloads.size, PDO_BYTES), codecs, strict=True)
        ]
        self._payload_bytes = self._payloads.reshape(-1).data
        self._memory = pool, axis_of, outputs, self._inputs, self._received, self._reference
        before, after = (self.axes, self._contours, self._tables), (self.row, self._payloads)
        self._step_axes = ready_for(step_axes, *before, *self._memory, False, 0.0, 0, 0, *after)
        begin_watch(self.axes.copy()[0], 0.0)

    def step(
        self,
        inputs: Sequence[bytes | bytearray | None],
        reference: Sequence[float] | None,
        time_s: float,
        cycle: int,
        segment: int,
    ) -> bool:
        """Advance all axes by one cycle; return whether any has an event. See `axis_step.step_axes`.

        `inputs`: the data of each TPDO, None = missing. `reference`: set points; None = each axis holds the
        position at which it was taken over.
        """
        memory, received, start = self._input_bytes, self._received_bytes, 0
        for node, data in enumerate(inputs):
            if data is None:
                received[node] = 0
            else:
                received[node] = 1
                memory[start : start + len(data)] = data
            start += PDO_BYTES
        if reference is not None:
            self._put_reference(self._reference_bytes, 0, *reference)
        return self._step_axes(
            self.axes,
            self._contours,
            self._tables,
            *self._memory,
            reference is not None,
            time_s,
            cycle,
            segment,
            self.row,
            self._payloads,
        )

    def payloads(self) -> list[bytes]:
        """Return the data of the RPDOs, axis by axis."""
        memory = self._payload_bytes
        return [bytes(memory[span]) for span in self._spans]

    def record(self, axis: int) -> Any:
        """Return the record of an axis."""
        return self.axes[axis]

    def params(self, axis: int) -> AxisParams:
        """Return the parameters of an axis's control law."""
        return self._params[axis]

    def coupled(self) -> tuple[tuple[int, int], float] | None:
        """Return the axes under contour control and their contour error (m); None if it is off."""
        for contour in self._contours:
            return (int(contour["axes"]["first"]), int(contour["axes"]["second"])), float(contour["error_m"])
        return None

    def change_params(self, axis: int, params: AxisParams) -> None:
        """Change the control-law parameters of an axis from the next cycle on; its state stays."""
        self._params[axis] = params
        self._tables = store(self.axes["law"]["params"], self._params)
