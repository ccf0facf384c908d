"""Reads the temperatures of the machine file by SDO beside the cycle: one by one, each wait bounded."""

import asyncio
from collections.abc import Callable, Mapping

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.node_model import Temperature
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.page.object_access import ObjectAccess
from servo_ctrl.learning.temperature_input import TemperatureInput, after_reading, without_reading

READING_S = 1.0
"""Pause between readings, wall clock; chosen: temperatures of guides change within minutes."""
NOTED_AFTER = 3
"""Readings in a row without a temperature after which an event says so; chosen."""


class Temperatures:
    """`use(axis, temperature, elapsed_s)` gets each reading, and the machine time since the one before."""

    def __init__(
        self,
        config: MachineConfig,
        machine: MachineController,
        objects: ObjectAccess,
        use: Callable[[str, TemperatureInput, float], None],
    ) -> None:
        self._machine, self._objects, self._use, self._period_s = machine, objects, use, config.period_s
        self._sources: Mapping[str, Temperature] = {
            name: axis.temperature for name, axis in config.axes.items() if axis.temperature is not None
        }
        self._inputs = dict.fromkeys(self._sources, TemperatureInput())
        self._failed = dict.fromkeys(self._sources, 0)
        self._cycles = dict.fromkeys(self._sources, 0)

    async def run(self) -> None:
        """Read until cancelled; return at once if no axis has a temperature."""
        while self._sources:
            for axis, source in self._sources.items():
                await self._read(axis, source)
            await asyncio.sleep(READING_S)

    async def _read(self, axis: str, source: Temperature) -> None:
        outcome = await self._objects.read(source.node_id, source.index, source.subindex)
        before, value = self._inputs[axis], outcome.value
        if isinstance(value, int | float):
            now = after_reading(before, source.offset_degc + source.k_per_count * value)
        else:
            now = without_reading(before, outcome.reason or f"{value!r} is no number")
        self._inputs[axis] = now
        self._note(axis, now)
        cycles, self._cycles[axis] = self._cycles[axis], self._machine.cycles
        self._use(axis, now, (self._machine.cycles - cycles) * self._period_s)

    def _note(self, axis: str, now: TemperatureInput) -> None:
        """Log that a temperature has failed for a while, and that it is there again."""
        failed = self._failed[axis]
        self._failed[axis] = failed + 1 if now.reason else 0
        if self._failed[axis] == NOTED_AFTER:
            self._machine.note(f"axis {axis}: no temperature: {now.reason}")
        elif failed >= NOTED_AFTER and not now.reason:
            self._machine.note(f"axis {axis}: the temperature is there again, {now.degc:.1f} degC")
