"""The interface that executes requests from the CANopen node, the MQTT link and the local socket."""

from typing import Protocol

from servo_ctrl.commands.command import CommandRequest, CommandResult
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.config.part_program import PartProgram, ReadingOptions
from servo_ctrl.config.program_model import ProgramConfig


class CommandHandler(Protocol):
    """Executes requests. The thread of the cycle makes all calls, which return at once."""

    def execute(self, request: CommandRequest) -> CommandResult:
        """Execute a command, or refuse it with a reason."""

    def change(self, setting: str, value: float | str | bool) -> CommandResult:
        """Change a field of `settings.Settings`, SI units, or refuse with a reason."""

    def jog(self, axis: str, velocity_m_s: float) -> CommandResult:
        """Move an axis at this velocity until no call renews it within `JOG_RENEWAL_S`; 0 stops the axis.

        The motion respects acceleration limit and travel. Several axes may jog at once.
        """

    def jog_step(self, axis: str, distance_m: float) -> CommandResult:
        """Move an axis by this distance, at most `LONGEST_STEP_M`, to rest."""

    def touch_off(self, axis: str, value_m: float) -> CommandResult:
        """Shift the chosen work offset so that this axis, "" = all, stands at the coordinate `value_m`."""

    def reading(self, first_line: int = 1) -> ReadingOptions:
        """Return the present options for reading a part program. Raises ConfigError."""

    def reading_of_line(self) -> ReadingOptions:
        """Return the options for a line of G-code that starts where the axes stand. Raises ConfigError."""

    def run_line(self, program: PartProgram) -> CommandResult:
        """Run a line of G-code from where the axes stand; its modal words hold for the next line."""

    def load_program(self, program: ProgramConfig) -> CommandResult:
        """Check a program and make it the program of the run; the status shows the outcome."""

    def status(self) -> MachineStatus:
        """Return the present status."""
