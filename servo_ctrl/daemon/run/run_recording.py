"""The recording of a run, if there is one, with its header during and after the run."""

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from kernels.arrays import Array
from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.run.report import Pacing, RunReport, recording_header, with_spans
from servo_ctrl.daemon.run.setup_header import in_use_header, setup_header
from servo_ctrl.daemon.set_points.reference import StepSpan
from servo_ctrl.motion.program import Step
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.recorder import Recorder, RecordingError

LOCKSTEP_WAIT_S = 10.0
"""How long lockstep may wait for a slow disk (chosen); real time never waits."""


class RunRecording:
    """Opened before the first SYNC, closed after the last. Raises RecordingError if it cannot be opened."""

    def __init__(
        self,
        directory: Path | None,
        machine: MachineConfig,
        steps: Sequence[Step],
        handler: CommandHandler,
        *,
        program: Path | None,
        pacing: Pacing,
    ) -> None:
        channels = channels_of(machine.axes)
        self._machine, self._handler = machine, handler
        header = recording_header(
            machine, channels, steps, program=program, pacing=pacing, started=datetime.now(UTC)
        )
        self._header = header | setup_header(machine)
        self._recorder: Recorder | None = None
        if directory is not None:
            wait_s = LOCKSTEP_WAIT_S if pacing == "lockstep" else 0.0
            self._recorder = Recorder(directory, channels, self._present_header(()), wait_s=wait_s)

    @property
    def record(self) -> Callable[[Array], None] | None:
        """The function that records the row of each cycle from memory; None without a recording."""
        return self._recorder.record if self._recorder is not None else None

    @property
    def problem(self) -> str:
        """What cannot be written, else ""; the run continues unrecorded and counts as failed."""
        recorder = self._recorder
        if recorder is None:
            return ""
        if recorder.problem:
            return f"the recording ends here: {recorder.directory}: {recorder.problem}"
        return f"{recorder.directory}: the disk is too slow, rows are lost" if recorder.rows_lost else ""

    def publish(self, spans: Sequence[StepSpan]) -> None:
        """Write the steps begun so far into recording.json, so that they survive a kill."""
        if self._recorder is not None:
            self._recorder.update_header(self._present_header(spans))

    def final_header(self, report: RunReport) -> dict[str, Any]:
        """Return the last header: how the run ended, and which compensations act at this instant."""
        return self._present_header(report.spans) | report.as_header()

    def close(self, header: dict[str, Any]) -> str:
        """Write the remaining rows and the last header. Blocking. Return what could not be written."""
        if self._recorder is not None:
            try:
                self._recorder.close(header)
            except RecordingError as error:
                return str(error)
        return ""

    def _present_header(self, spans: Sequence[StepSpan]) -> dict[str, Any]:
        """Return the present header; compensation and J_required may change during the run."""
        return with_spans(self._header, spans) | in_use_header(self._machine, self._handler.status())
