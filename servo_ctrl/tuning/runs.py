"""The interface between a tuning and the machine that makes its motions."""

from typing import Protocol

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.excitation.tuning_motion import TuningMotion
from servo_ctrl.recording.reader import Recording


class RunFailedError(TuneError):
    """A run ended before the end of its program, or the axis did not stand still in it."""


class Runs(Protocol):
    """Makes the motions of a tuning, one after the other."""

    def in_present_coordinates(self, machine: MachineConfig) -> MachineConfig:
        """Return the machine with its position limits in the coordinates of the next run."""

    async def record(self, machine: MachineConfig, motion: TuningMotion, name: str) -> Recording:
        """Make a motion with the values of `machine`, and return its recording.

        Raises RunFailedError where softer values may help, another TuneError where the tuning has to end.
        """
