"""The report of a run of ten cycles without events."""

from servo_ctrl.commands.learning_status import LearningState, LearningStatus
from servo_ctrl.daemon.run.report import RunReport

REPORT = RunReport(
    machine="table",
    completed=False,
    failed=False,
    signal="",
    reason="",
    events=(),
    cycles=10,
    missed_ticks=0,
    missing_inputs=0,
    wall_s=0.01,
    spans=(),
    lateness=None,
    recording=None,
    learning=LearningStatus(LearningState.IDLE, "", None, ""),
    outcomes=(),
)
