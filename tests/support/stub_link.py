"""A link without a machine, for tests of the page: two axes on a synthetic circle, driven by a counter."""

import asyncio
import math
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from stub_status import AXES, FIRST_REVERSAL, NODES, first_status

from servo_ctrl.commands.local_messages import (
    AxisInfo,
    ChannelInfo,
    Hello,
    LocalAnswer,
    LocalRequest,
    NodeInfo,
    Requester,
    Reversal,
)
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.link.row_ring import RowRing
from servo_ctrl.recording.channels import channels_of

PERIOD_S = 1e-3
RADIUS_M = 0.025
TURN_S = 4.0
BUMP_M = 5e-6
"""Error of the axis that has just reversed."""
MACHINE = Path("machines/xy_table")


class StubLink:
    """The interface of `hmi.machine_link.MachineLink`. `advance` advances time; commands change the stage."""

    def __init__(self, path: Path = Path("stub")) -> None:
        self.path = path
        self.connected = True
        self.problem = ""
        self.hello = Hello(
            machine="stub table",
            period_s=PERIOD_S,
            axes=tuple(AxisInfo(name=name, travel_m=(-0.1, 0.1), velocity_m_s=0.2) for name in AXES),
            channels=tuple(
                ChannelInfo(name=c.name, unit=c.unit, meaning=c.meaning) for c in channels_of(AXES)
            ),
            nodes=tuple(NodeInfo(name=name, node_id=node_id, eds=eds) for name, node_id, eds in NODES),
            machine_file=str(MACHINE / "controller.toml"),
            learned_dir=str(MACHINE / "learned"),
            record_dir=None,
            pid=1,
        )
        self.rows = RowRing([channel.name for channel in self.hello.channels], 60_000)
        self.reversals: deque[Reversal] = deque(maxlen=500)
        self.listeners: list[Callable[[MachineStatus], None]] = []
        self.requests: list[LocalRequest] = []
        """Requests in order."""
        self.answers: dict[str, LocalAnswer] = {}
        """Answers other than "accepted", by `do` or by the name of a command."""
        self.objects: dict[tuple[int, int, int], int | float | str] = {(1, 0x1000, 0): 0x20192}
        """Values of objects by node, index and subindex."""
        self.status: MachineStatus = first_status()

    async def run(self) -> None:
        """Advance time at its real rate, thirty times a second."""
        while True:
            await asyncio.sleep(1.0 / 30.0)
            self.advance(round(1.0 / 30.0 / PERIOD_S))

    def advance(self, cycles: int) -> None:
        """Deliver rows with their reversals, and a status."""
        first = self.status.cycles
        if self.connected:
            self.rows.extend(self._rows(first, cycles))
            for cycle in range(first, first + cycles):
                self._reverse(cycle)
        self.change(cycles=first + cycles)

    def change(self, **fields: Any) -> None:
        """Change fields of the status, and call the listeners: `change(stage=Stage.RUNNING)`."""
        self.status = self.status._replace(**fields)
        for listener in tuple(self.listeners):
            listener(self.status)

    async def request(self, who: Requester, do: str, **fields: Any) -> LocalAnswer:
        """Accept the request, unless `answers` holds another answer; the status shows its effect."""
        request = LocalRequest.model_validate({"id": len(self.requests) + 1, "who": who, "do": do, **fields})
        self.requests.append(request)
        answer = self.answers.get(request.command or do, LocalAnswer(id=0, accepted=True))
        if answer.accepted:
            answer = answer._replace(value=self._carry_out(request))
        return answer._replace(id=request.id)

    def _carry_out(self, request: LocalRequest) -> int | float | str | None:
        if request.node is not None and request.index is not None:
            address = (request.node, request.index, request.subindex or 0)
            if request.do == "write_object" and not isinstance(request.value, bool | None):
                self.objects[address] = request.value
            return self.objects.get(address, 0)
        stage = {
            "enable": Stage.READY,
            "disable": Stage.STANDBY,
            "quick_stop": Stage.STANDBY,
            "start_program": Stage.RUNNING,
            "abort_program": Stage.READY,
        }.get(request.command or "")
        if stage is not None:
            step = 0 if stage is Stage.RUNNING else -1
            self.change(stage=stage, program=self.status.program._replace(step=step))
        if request.command in {"hold_program", "resume_program"}:
            held = request.command == "hold_program"
            self.change(program=self.status.program._replace(held=held))
        return None

    def _rows(self, first: int, count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
        cycles = np.arange(first, first + count)
        time_s = cycles * PERIOD_S
        angle = 2.0 * math.pi * time_s / TURN_S
        rate = 2.0 * math.pi / TURN_S
        rows = np.zeros((count, len(self.rows.names)))
        place = self.rows.place
        rows[:, place("time_s")], rows[:, place("cycle")] = time_s, cycles
        for axis, at, along in (("x", np.cos(angle), -np.sin(angle)), ("y", np.sin(angle), np.cos(angle))):
            error_m = BUMP_M * np.sign(along) * np.exp(-(np.mod(angle, math.pi / 2.0)) / 0.05)
            rows[:, place(f"{axis}.position_command_m")] = RADIUS_M * at
            rows[:, place(f"{axis}.velocity_command_m_s")] = RADIUS_M * rate * along
            rows[:, place(f"{axis}.motor_position_m")] = RADIUS_M * at - error_m
            rows[:, place(f"{axis}.scale_position_m")] = RADIUS_M * at - error_m
            rows[:, place(f"{axis}.motor_velocity_m_s")] = RADIUS_M * rate * along
            rows[:, place(f"{axis}.position_error_m")] = error_m
            rows[:, place(f"{axis}.force_command_n")] = 20.0 * np.sign(along)
            rows[:, place(f"{axis}.statusword")] = 0x1637
        return rows

    def _reverse(self, cycle: int) -> None:
        half_turn = round(TURN_S / PERIOD_S / 2)
        for axis, phase in (("x", 0), ("y", half_turn // 2)):
            if (cycle - phase) % half_turn == 0 and cycle:
                report = FIRST_REVERSAL._replace(cycle=cycle, direction=1 if cycle // half_turn % 2 else -1)
                trace = tuple(BUMP_M * math.exp(-k / 30.0) for k in range(200))
                self.reversals.append(Reversal(axis=axis, report=report, period_s=PERIOD_S, error_m=trace))
