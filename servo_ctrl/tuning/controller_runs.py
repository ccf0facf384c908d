"""The runs of a tuning on a controller that is in charge of the machine, by its local socket.

The controller makes the motions, bounds them and records them (`daemon.run.tuning_runs`); between two of them
its own values act. Its drives keep their power and their home.
"""

import asyncio
import shutil
from pathlib import Path

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation import notch
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.excitation.tuning_motion import TuningMotion
from servo_ctrl.hil_rig.simulated_run import new_recording
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.recording.reader import Recording, load_recording
from servo_ctrl.tuning.proposal import NotchValues

RUN_LIMIT_S = 900.0
"""Bounds a motion, which takes half a minute of machine time; chosen."""
CONNECT_LIMIT_S, CONNECT_POLL_S = 10.0, 0.05
"""Bounds the wait for the controller's socket, and interval at which it is checked; chosen."""
HEARTBEAT_S = 0.25
"""Interval of heartbeats in a motion: a twelfth of `daemon.run.client_watch.SILENCE_S`."""


class ControllerRuns:
    """Requests one motion after the other from a controller; recordings go below `out`."""

    def __init__(self, link: MachineLink, who: Requester, out: Path) -> None:
        self._link, self._who, self._out = link, who, out

    async def connected(self) -> None:
        """Wait for the connection, which a long computation may have lost. Raises TuneError without one."""
        try:
            async with asyncio.timeout(CONNECT_LIMIT_S):
                while not self._link.connected:  # noqa: ASYNC110  # bounded, and short
                    await asyncio.sleep(CONNECT_POLL_S)
        except TimeoutError:
            raise TuneError(f"the controller does not answer: {self._link.problem}") from None

    def in_present_coordinates(self, machine: MachineConfig) -> MachineConfig:
        """Return the machine as it is: the axes keep their home."""
        return machine

    async def record(self, machine: MachineConfig, motion: TuningMotion, name: str) -> Recording:
        """Let the controller make the motion, and return its recording.

        Raises TuneError where the controller has another machine file, refused the motion or ended it early.
        A cancelled wait ends the motion.
        """
        axis = machine.axes[motion.axis]
        filtered = axis.section(notch.NotchSettings)
        fields = {
            **motion._asdict(),
            "control": axis.control.model_dump(),
            "notch": filtered and {key: getattr(filtered, key) for key in ("enabled", *NotchValues._fields)},
        }
        await self.connected()
        self._check_machine_file(machine)  # each time: another controller may have been started meanwhile
        heartbeats = asyncio.create_task(self._send_heartbeats())
        try:
            answer = await self._link.request(self._who, "tuning_run", limit_s=RUN_LIMIT_S, tuning=fields)
        except asyncio.CancelledError:
            await self._link.request(self._who, "command", command="abort_program")
            raise
        finally:
            heartbeats.cancel()
        if not answer.accepted:
            raise TuneError(f"the controller has made no run: {answer.reason}; nothing was changed")
        directory = new_recording(self._out, name)
        await asyncio.to_thread(shutil.copytree, str(answer.value), directory)
        return await asyncio.to_thread(load_recording, directory)

    async def _send_heartbeats(self) -> None:
        """Send heartbeats, without which the controller ends the motion."""
        while True:
            await asyncio.sleep(HEARTBEAT_S)
            await self._link.request(self._who, "heartbeat")

    def _check_machine_file(self, machine: MachineConfig) -> None:
        """Raise TuneError unless the controller was started with the content of this machine file."""
        hello = self._link.hello
        if hello is None or hello.machine_sha256 != machine.source_sha256:
            read = "" if hello is None else hello.machine_file
            raise TuneError(
                f"{machine.source} is not what the controller was started with: it has read {read}, and the "
                "content differs. Start the controller again with the file that is to be tuned"
            )
