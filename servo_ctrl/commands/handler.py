"""What carries out the requests of the CANopen node, the MQTT link and the local socket."""

from typing import Protocol

from servo_ctrl.commands.command import CommandRequest, CommandResult
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.config.part_program import PartProgram, ReadingOptions
from servo_ctrl.config.program_model import ProgramConfig


class CommandHandler(Protocol):
    """Carries requests out. All calls are made in the thread of the cycle and return at once."""

    def execute(self, request: CommandRequest) -> CommandResult:
        """Carry out a command, or say why not."""

    def change(self, setting: str, value: float | str | bool) -> CommandResult:
        """Change a field of `machine_status.Settings`, SI; or say why not."""

    def jog(self, axis: str, velocity_m_s: float) -> CommandResult:
        """Move an axis at this velocity until `JOG_RENEWAL_S` has gone by without another call; 0 stops it.

        Within the acceleration limit and the travel. Several axes may jog at once.
        """

    def jog_step(self, axis: str, way_m: float) -> CommandResult:
        """Move an axis by this way, at most `LONGEST_STEP_M`, to rest there."""

    def touch_off(self, axis: str, value_m: float) -> CommandResult:
        """Call the place where an axis stands, "" = all, `value_m` in the chosen work offset."""

    def reading(self, first_line: int = 1) -> ReadingOptions:
        """What a part program is read with now. Raises ConfigError."""

    def reading_of_line(self) -> ReadingOptions:
        """What a line of G-code is read with, from where the axes stand. Raises ConfigError."""

    def run_line(self, program: PartProgram) -> CommandResult:
        """Run a line of G-code from where the axes stand; what it sets holds for the next one."""

    def load_program(self, program: ProgramConfig) -> CommandResult:
        """Check a program and let it replace that of the run; the status shows the outcome."""

    def status(self) -> MachineStatus:
        """The status now."""
