"""Runs the simulator as a process that prints its true motion: a line of JSON at SIGUSR1 and at the end.

python -m tests.campaigns.hostile.simulator MACHINE BUS
"""

import asyncio
import json
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hil_sim.config import load_plant
from hil_sim.runner.bench import SimulatedMachine
from hil_sim.runner.can_port import CanPort, open_bus
from hil_sim.runner.process import serve


class TruthWindow:
    """The true motion of the axes since the last printed line."""

    def __init__(self, bench: SimulatedMachine) -> None:
        self._bench = bench
        state = bench.plant.state
        self._position, self._velocity = state["table_position_m"], state["table_velocity_m_s"]
        bench.on_advanced = self._advanced
        self._begin()

    def print_line(self) -> None:
        """Print the motion as one line of JSON and begin a new window."""
        finite = bool(np.isfinite(self._position).all() and np.isfinite(self._velocity).all())
        figures: dict[str, Any] = {
            "start_m": self._start.tolist(),
            "end_m": self._position.tolist(),
            "moved_m": float((self._high - self._low).max()),
            "furthest_m": float(np.abs([self._low, self._high]).max()),
            "fastest_m_s": self._fastest,
            "powered": self._powered,
            "finite": finite,
            "advances": self._advances,
        }
        print(json.dumps(figures), flush=True)
        self._begin()

    def _begin(self) -> None:
        self._start, self._low, self._high = (np.array(self._position) for _ in range(3))
        self._fastest, self._powered, self._advances = 0.0, False, 0

    def _advanced(self) -> None:
        self._advances += 1
        np.minimum(self._low, self._position, out=self._low)
        np.maximum(self._high, self._position, out=self._high)
        self._fastest = max(self._fastest, float(np.abs(self._velocity).max()))
        self._powered = self._powered or any(drive.motion.powered for drive in self._bench._drives.drives)


async def main(machine: Path, bus: str) -> None:
    """Run the simulator until SIGTERM."""
    windows: list[TruthWindow] = []

    def ready(bench: SimulatedMachine) -> None:
        windows.append(TruthWindow(bench))
        asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, windows[0].print_line)
        print("on the bus", flush=True)

    await serve(
        load_plant(machine),
        lambda: CanPort(open_bus(bus)),
        realtime=False,
        state_directory=None,
        on_ready=ready,
    )
    windows[0].print_line()


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1]), sys.argv[2]))
