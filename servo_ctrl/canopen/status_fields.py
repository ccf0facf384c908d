"""The desk's status as the numbers of our objects: one function a record, its fields from subindex 1 on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.canopen import objects as o
from servo_ctrl.config.desk import LEARNERS, LearningState, Setting

if TYPE_CHECKING:
    from servo_ctrl.config.desk import AxisStatus, DeskStatus
    from servo_ctrl.learning.types import Outlook, ReversalReport

COUNT_MAX = 0xFFFF
PROGRESS_MAX = 1000


def settings_fields(status: DeskStatus) -> tuple[int, ...]:
    """2104h."""
    settings = status.settings
    required_nm = o.whole(settings[Setting.REQUIRED_M], o.NM)
    return required_nm, int(settings[Setting.LEARNER]), int(settings[Setting.ADAPTATION])


def learning_fields(status: DeskStatus) -> tuple[int, ...]:
    """2110h."""
    learning = status.learning
    names = [axis.name for axis in status.axes[: o.AXES]]
    axis = names.index(learning.axis) + 1 if learning.axis in names else 0
    outlook = learning.outlook
    if outlook is None:
        return learning.state, axis, 0, 0, 0, o.NONE_32, 0, o.NONE_32
    return (
        learning.state,
        axis,
        min(outlook.strokes_done, COUNT_MAX),
        min(outlook.strokes_total, COUNT_MAX),
        o.whole(outlook.remaining_s, 1.0),
        o.whole(outlook.best_m, o.NM),
        _progress(learning.state, outlook),
        o.whole(outlook.acceleration_m_s2, o.UM_S2),
    )


def stage_text(status: DeskStatus) -> str:
    """2111h."""
    outlook = status.learning.outlook
    return outlook.stage if outlook is not None else ""


def summary_fields(status: DeskStatus) -> tuple[int, ...]:
    """2113h: due mask, the axis that last reversed, its J in tenths of a micrometre."""
    axes = status.axes[: o.AXES]
    due = sum(1 << number for number, axis in enumerate(axes) if axis.learning_due)
    reversals = [axis.last for axis in axes if axis.last is not None]
    if not reversals:
        return due, 0, o.NONE_16
    last = max(reversals, key=lambda report: report.cycle)
    return due, last.axis + 1, o.whole(last.error_mean_m, o.DECIMICRON, o.NONE_16)


def monitoring_fields(axis: AxisStatus) -> tuple[int, ...]:
    """2120h + n."""
    head = (int(axis.learning_due), axis.reversals & o.NONE_32)
    last: ReversalReport | None = axis.last
    if last is None:
        return (*head, *5 * (o.NONE_32,), 0, 0)
    return (
        *head,
        o.whole(last.error_mean_m, o.NM),
        o.whole(last.error_peak_m, o.NM),
        o.whole(last.error_rms_m, o.NM),
        o.whole(last.contour_peak_m, o.NM),
        o.whole(last.acceleration_m_s2, o.UM_S2),
        last.direction,
        last.cycle & o.NONE_32,
    )


def result_fields(axis: AxisStatus) -> tuple[int | str, ...]:
    """2130h + n."""
    learned = axis.learned
    version = min(axis.version, COUNT_MAX)
    if learned is None:
        return version, axis.learned_at, o.NONE_8, o.NONE_32, o.NONE_32, 0, 0, 0, 0, 0, 0
    return (
        version,
        axis.learned_at,
        LEARNERS.index(learned.learner) if learned.learner in LEARNERS else o.NONE_8,
        o.whole(learned.before_m, o.NM),
        o.whole(learned.after_m, o.NM),
        min(learned.strokes, COUNT_MAX),
        o.whole(learned.machine_time_s, 1.0),
        o.whole(learned.spread_m_s2, o.UM_S2),
        len(learned.durations),
        len(learned.amplitudes),
        len(learned.trailing),
    )


def function_fields(axis: AxisStatus) -> tuple[bytes, ...]:
    """2140h + n."""
    learned = axis.learned
    if learned is None:
        return b"", b"", b""
    return (
        o.packed_rows(learned.durations, o.DURATION_UNITS),
        o.packed_rows(learned.amplitudes, o.AMPLITUDE_UNITS),
        o.packed_rows(learned.trailing, o.TRAILING_UNITS),
    )


def screw_fields(axis: AxisStatus) -> tuple[int | str, ...]:
    """2150h + n."""
    screw, learned = axis.screw, axis.screw.learned
    version = min(screw.version, COUNT_MAX)
    if learned is None:
        return version, screw.learned_at, *4 * (o.NONE_32,), 0, 0, 0
    return (
        version,
        screw.learned_at,
        o.whole(learned.before_m, o.NM),
        o.whole(learned.after_m, o.NM),
        o.whole(learned.lost_motion_m, o.NM),
        o.whole(learned.spread_m, o.NM),
        min(learned.strokes, COUNT_MAX),
        o.whole(learned.machine_time_s, 1.0),
        len(learned.points),
    )


def screw_table(axis: AxisStatus) -> tuple[bytes, ...]:
    """2160h + n."""
    learned = axis.screw.learned
    return (b"" if learned is None else o.packed_rows(learned.points, o.SCREW_UNITS),)


def _progress(state: LearningState, outlook: Outlook) -> int:
    if state is LearningState.DONE:
        return PROGRESS_MAX
    return min(PROGRESS_MAX * outlook.strokes_done // max(outlook.strokes_total, 1), PROGRESS_MAX)
