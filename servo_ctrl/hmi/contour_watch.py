"""Keeps the last turn of every circle that the machine runs, by what compensated it; whoever looks or not."""

from __future__ import annotations

import math
import time
from collections import OrderedDict
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from servo_ctrl.hmi.contour_turns import PlaneRows, Turn, newest_turn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from servo_ctrl.config.local_status import Status
    from servo_ctrl.hmi.contour_turns import Kind
    from servo_ctrl.hmi.machine_link import MachineLink
    from servo_ctrl.hmi.row_ring import RowRing

    Array = NDArray[np.float64]

LOOK_S = 0.5
KEPT_TURNS = 24
PARTS = (
    "position_command_m",
    "velocity_command_m_s",
    "scale_position_m",
    "motor_position_m",
    "pulse_m_s",
    "disturbance_n",
)
_WATCHES: WeakKeyDictionary[MachineLink, ContourWatch] = WeakKeyDictionary()


def watch_of(link: MachineLink) -> ContourWatch:
    """The one of this link; it begins when it is first asked for."""
    watch = _WATCHES.get(link)
    if watch is None:
        watch = _WATCHES[link] = ContourWatch()
        link.listeners.append(lambda status: watch.hear(status, link.rows, axes_of(link), time.monotonic()))
    return watch


def axes_of(link: MachineLink) -> tuple[str, ...]:
    """Names of the axes; none before the machine has said them."""
    return tuple(axis.name for axis in link.hello.axes) if link.hello is not None else ()


class ContourWatch:
    """`kept` are turns by circle and kind, the newest last; `version` counts their changes."""

    def __init__(self) -> None:
        self.kept: OrderedDict[tuple[tuple[int, int, int], Kind], Turn] = OrderedDict()
        self.version = 0
        self._next_s = 0.0
        self._looked = 0
        self._since_cycle = self._cycles = 0
        self._switches: tuple[object, ...] = ()

    def hear(self, status: Status, ring: RowRing, axes: Sequence[str], now_s: float) -> None:
        """A status has come: look for a new turn, twice a second at most."""
        self._cycles = status.cycles
        switches = tuple(
            (axis.name, axis.compensation_enabled, axis.observer_enabled, axis.version)
            for axis in status.axes
        )
        if switches != self._switches:
            # what was run before belongs to another compensation, and a turn of both to none
            self._since_cycle = status.cycles if self._switches else 0
            self._switches = switches
        if now_s >= self._next_s and len(axes) >= 2:
            self._next_s = now_s + LOOK_S
            self.look(ring, (axes[0], axes[1]))

    def look(self, ring: RowRing, plane: tuple[str, str]) -> None:
        """Keep the turns that end in the rows since the last look."""
        first = max(self._looked, ring.first)
        segment = ring.column("segment", first)
        velocity = np.column_stack([ring.column(f"{axis}.velocity_command_m_s", first) for axis in plane])
        self._looked = ring.end
        begins = [0, *(np.flatnonzero(np.diff(segment)) + 1).tolist()]
        for begin, end in zip(begins, [*begins[1:], len(segment)], strict=True):
            length = rows_of_turn(velocity[begin:end])
            if length > ring.capacity:
                continue
            since = max(first + begin - int(length), ring.first)
            rows = plane_rows(ring, plane, since)
            turn = newest_turn(PlaneRows(*(part[: first + end - since] for part in rows)), self._since_cycle)
            if turn is not None:
                self._keep(turn)

    def circles(self) -> list[tuple[int, int, int]]:
        """The circles there are turns of, the newest first."""
        return list(dict.fromkeys(key for key, _ in reversed(self.kept)))

    def turns(self, circle: tuple[int, int, int]) -> list[Turn]:
        """The turns of one circle, by kind."""
        found = [turn for (key, _), turn in self.kept.items() if key == circle]
        return sorted(found, key=lambda turn: list(ORDER).index(turn.kind))

    def forget(self) -> None:
        """Keep nothing of what was run so far; a turn that is under way counts from here on."""
        self.kept.clear()
        self._since_cycle = self._cycles
        self.version += 1

    def _keep(self, turn: Turn) -> None:
        name = (turn.key, turn.kind)
        before = self.kept.get(name)
        if before is not None and before.last_cycle == turn.last_cycle:
            return
        self.kept[name] = turn
        self.kept.move_to_end(name)
        if len(self.kept) > KEPT_TURNS:
            self.kept.popitem(last=False)
        self.version += 1


ORDER: tuple[Kind, ...] = ("without", "pulse", "observer", "both")


def rows_of_turn(velocity_m_s: Array) -> float:
    """How many rows a whole turn takes at the rate at which the velocity (n, 2) turns; inf: it does not."""
    moving = velocity_m_s[np.hypot(*velocity_m_s.T) > 0.0]
    if len(moving) < 3:
        return math.inf
    angle = np.unwrap(np.arctan2(moving[:, 1], moving[:, 0]))
    rate = abs(angle[-1] - angle[0]) / (len(angle) - 1)
    return math.ceil(1.02 * 2.0 * math.pi / rate) + 10 if rate > 0.0 else math.inf


def plane_rows(ring: RowRing, plane: tuple[str, str], since: int) -> PlaneRows:
    """The rows from this number on, of two axes."""
    parts = {
        part: np.column_stack([ring.column(f"{axis}.{part}", since) for axis in plane]) for part in PARTS
    }
    scale_m, motor_m = parts["scale_position_m"], parts["motor_position_m"]
    has_scale = np.isfinite(scale_m).any(axis=0)
    return PlaneRows(
        cycle=ring.column("cycle", since),
        segment=ring.column("segment", since),
        command_m=parts["position_command_m"],
        velocity_m_s=parts["velocity_command_m_s"],
        actual_m=np.where(has_scale, scale_m, motor_m),
        pulse_m_s=parts["pulse_m_s"],
        disturbance_n=parts["disturbance_n"],
    )
