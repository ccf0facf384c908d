"""Reads scheduled faults from the command line, and starts and ends them by the bench's time."""

import math
import pkgutil
from collections.abc import Mapping, Sequence
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple

from hil_sim import faults
from hil_sim.faults.fault_target import FaultError, FaultTarget
from hil_sim.node.nmt import NEVER_US
from kernels.quantities import fields_of


def fault_kinds() -> dict[str, ModuleType]:
    """Return the modules of this room that declare a fault, by name."""
    names = sorted(info.name for info in pkgutil.iter_modules(faults.__path__))
    modules = {name: import_module(f"{faults.__name__}.{name}") for name in names}
    return {name: module for name, module in modules.items() if hasattr(module, "Params")}


class Fault(NamedTuple):
    """One scheduled fault. `params` is the `Params` of its file."""

    kind: str
    axis: str
    at_s: float
    """Simulated time since power-up."""
    params: Any


def read_fault(text: str) -> Fault:
    """Read "KIND:AXIS@SECONDS[,KEY=NUMBER...]", e.g. "mute_node:x@3.2,duration_s=0.5". Raises FaultError."""
    kind, colon, tail = text.partition(":")
    axis, at, tail = tail.partition("@")
    if not (colon and at and axis):
        raise FaultError(f"fault {text!r}: give KIND:AXIS@SECONDS[,KEY=NUMBER...]")
    kinds = fault_kinds()
    if kind not in kinds:
        raise FaultError(f"fault {text!r}: there is no {kind!r}, only {', '.join(kinds)}")
    at_text, *pairs = tail.split(",")
    fields = {field.key: field for field in fields_of(kinds[kind].Params)}
    values = {}
    for key, _, number in (pair.partition("=") for pair in pairs):
        field = fields.get(key)
        if field is None:
            raise FaultError(f"fault {text!r}: {kind} has no {key!r}, only {', '.join(fields) or 'nothing'}")
        value = field.quantity.to_si(_number(text, number))
        if not field.quantity.lower <= value <= field.quantity.upper:
            raise FaultError(f"fault {text!r}: {key} is not within its bounds")
        values[field.name] = value
    at_s = _number(text, at_text)
    if at_s < 0.0:
        raise FaultError(f"fault {text!r}: the time must be 0 or later")
    return Fault(kind, axis, at_s, kinds[kind].Params(**values))


def _number(text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FaultError(f"fault {text!r}: {number!r} is not a number")
    return value


class Schedule:
    """Starts and ends faults at their times. Raises FaultError for a fault that an axis cannot have."""

    def __init__(self, faults_scheduled: Sequence[Fault], axes: Mapping[str, FaultTarget]) -> None:
        kinds = fault_kinds() if faults_scheduled else {}
        self._pending: list[tuple[int, Any, FaultTarget, Any]] = []  # time (us), action, its arguments
        for fault in faults_scheduled:
            if fault.axis not in axes:
                raise FaultError(f"{fault.kind}: there is no axis {fault.axis!r}, only {', '.join(axes)}")
            module, target = kinds[fault.kind], axes[fault.axis]
            if hasattr(module, "check"):
                module.check(target, fault.params)
            at_us = round(fault.at_s * 1e6)
            self._pending.append((at_us, module.begin, target, fault.params))
            if hasattr(module, "end"):
                end_us = at_us + round(fault.params.duration_s * 1e6)
                self._pending.append((end_us, module.end, target, fault.params))
        self._pending.sort(key=lambda item: item[0])
        self._update()

    def run(self, now_us: int) -> None:
        """Start and end all faults that are due at `now_us`."""
        while now_us >= self.due_us:
            _, action, target, params = self._pending.pop(0)
            action(target, params)
            self._update()

    def _update(self) -> None:
        self.due_us = self._pending[0][0] if self._pending else NEVER_US
