"""Keeps the last turn of every circle that the machine runs, by compensation."""

import math
import time
from collections import OrderedDict
from collections.abc import Sequence
from functools import cache

import numpy as np

from kernels.arrays import Array
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.contour.turns import LABELS, CircleKey, Compensation, MeasuredTurn, PlaneRows, newest_turn
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.hmi.link.row_ring import RowRing

SEARCH_S = 0.5
"""Interval of the searches, seconds; chosen: a search of a long turn takes milliseconds."""
MAX_TURNS = 24
"""Bounds the memory; chosen: six circles with four compensations."""
TURN_RESERVE = 1.02
"""Rows that are searched over the rows of a turn; chosen: the speed of the turn is estimated within about
1 %."""
CHANNELS = (
    "position_command_m",
    "velocity_command_m_s",
    "scale_position_m",
    "motor_position_m",
    "pulse_m_s",
    "disturbance_n",
)


@cache
def turn_store_of(link: MachineLink) -> "TurnStore":
    """Return the store of this link, which starts to search when it is first asked for."""
    store = TurnStore()

    def on_status(status: MachineStatus) -> None:
        axes = tuple(axis.name for axis in link.hello.axes) if link.hello is not None else ()
        store.on_status(status, link.rows, axes, time.monotonic())

    link.listeners.append(on_status)
    return store


class TurnStore:
    """The kept turns by circle and compensation, the newest last; `version` counts their changes."""

    def __init__(self) -> None:
        self.version = 0
        self._turns: OrderedDict[tuple[CircleKey, Compensation], MeasuredTurn] = OrderedDict()
        self._next_search_s = 0.0
        self._searched = 0
        """Rows before this one were searched."""
        self._since_cycle = self._cycles = 0
        self._switches: tuple[object, ...] = ()

    def on_status(self, status: MachineStatus, ring: RowRing, axes: Sequence[str], now_s: float) -> None:
        """Search for a new turn in the plane of the first two axes, at most every SEARCH_S."""
        self._cycles = status.cycles
        switches = tuple(
            (axis.name, axis.compensation_enabled, axis.observer_enabled, axis.version)
            for axis in status.axes
        )
        if switches != self._switches:
            # a turn that spans the switching belongs to neither compensation
            self._since_cycle = status.cycles if self._switches else 0
            self._switches = switches
        if any(axis.compensation_suspended for axis in status.axes):
            # a tuning tries other gains: its turns tell nothing about a compensation, not even "without"
            self._since_cycle = status.cycles
        if now_s >= self._next_search_s and len(axes) >= 2:
            self._next_search_s = now_s + SEARCH_S
            self.search(ring, (axes[0], axes[1]))

    def search(self, ring: RowRing, plane: tuple[str, str]) -> None:
        """Keep the turns that end in the rows since the last search."""
        first = max(self._searched, ring.first)
        segment = ring.column("segment", first)
        velocity = np.column_stack([ring.column(f"{axis}.velocity_command_m_s", first) for axis in plane])
        self._searched = ring.end
        begins = [0, *(np.flatnonzero(np.diff(segment)) + 1).tolist()]
        for begin, end in zip(begins, [*begins[1:], len(segment)], strict=True):
            length = rows_of_turn(velocity[begin:end])
            if length > ring.capacity:
                continue
            since = max(first + begin - int(length), ring.first)
            rows = plane_rows(ring, plane, since)
            part = PlaneRows(*(column[: first + end - since] for column in rows))
            turn = newest_turn(part, self._since_cycle)
            if turn is not None:
                self._keep(turn)

    def circles(self) -> list[CircleKey]:
        """Return the circles of the kept turns, the newest first."""
        return list(dict.fromkeys(key for key, _ in reversed(self._turns)))

    def turns(self, circle: CircleKey) -> list[MeasuredTurn]:
        """Return the turns of one circle, in the order of LABELS."""
        order = list(LABELS)
        found = [turn for (key, _), turn in self._turns.items() if key == circle]
        return sorted(found, key=lambda turn: order.index(turn.compensation))

    def clear(self) -> None:
        """Drop all turns; the present one counts from here on."""
        self._turns.clear()
        self._since_cycle = self._cycles
        self.version += 1

    def _keep(self, turn: MeasuredTurn) -> None:
        name = (turn.key, turn.compensation)
        before = self._turns.get(name)
        if before is not None and before.last_cycle == turn.last_cycle:
            return
        self._turns[name] = turn
        self._turns.move_to_end(name)
        if len(self._turns) > MAX_TURNS:
            self._turns.popitem(last=False)
        self.version += 1


def rows_of_turn(velocity_m_s: Array) -> float:
    """Return the rows of a whole turn, from the rotation rate of the velocity (n, 2); inf: a line."""
    moving = velocity_m_s[np.hypot(*velocity_m_s.T) > 0.0]
    if len(moving) < 3:
        return math.inf
    angle = np.unwrap(np.arctan2(moving[:, 1], moving[:, 0]))
    rate = abs(angle[-1] - angle[0]) / (len(angle) - 1)
    return math.ceil(TURN_RESERVE * 2.0 * math.pi / rate) + 10 if rate > 0.0 else math.inf


def plane_rows(ring: RowRing, plane: tuple[str, str], since: int) -> PlaneRows:
    """Return the rows of two axes from row `since` on."""
    columns = {
        name: np.column_stack([ring.column(f"{axis}.{name}", since) for axis in plane]) for name in CHANNELS
    }
    scale_m, motor_m = columns["scale_position_m"], columns["motor_position_m"]
    has_scale = np.isfinite(scale_m).any(axis=0)
    return PlaneRows(
        cycle=ring.column("cycle", since),
        segment=ring.column("segment", since),
        command_m=columns["position_command_m"],
        velocity_m_s=columns["velocity_command_m_s"],
        actual_m=np.where(has_scale, scale_m, motor_m),
        pulse_m_s=columns["pulse_m_s"],
        disturbance_n=columns["disturbance_n"],
    )
