"""What must hold of the end of a run, its events, its recording and what was learned."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.learned.store import LearnedStore, StoreError
from servo_ctrl.learned.stroke_journal import JOURNAL_FILE
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import RecordingError
from tests.campaigns.campaign.causes import DRIFTED
from tests.campaigns.campaign.fault_context import DRIVES, NODES
from tests.campaigns.campaign.learning import known
from tests.campaigns.campaign.stand import ROWS_PER_PART

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.recording.reader import Recording
    from tests.campaigns.campaign.fault_context import Fault
    from tests.campaigns.campaign.run import Evidence

TPDO = 0x180
LED_STAGES = (2, 3, 4)
"""Ready, running, stopping: we lead the axes."""
EMCY = 0x080
TOLD_AFTER = 300
"""Ticks after which a broker has received a message."""
PLANTED = "planted by the campaign"
FULL = ("the disk was full", "No space left on device")


def over(evidence: Evidence) -> list[str]:
    """The run has come to its end, and not by a bug of ours."""
    problems = []
    if ("published", 0) in evidence.notes and evidence.ticks > TOLD_AFTER:
        problems.append("the broker had received nothing before it went")
    if evidence.stuck:
        problems.append(f"stuck: {evidence.stuck}")
    error, fault = evidence.error, evidence.plan.fault
    if error.startswith("refused: "):
        if evidence.plan.state != "booting":
            problems.append(f"the run was refused, and not while booting: {error}")
    elif error and not _meant(error, fault):
        problems.append(f"the run ended by {error}")
    return problems


def _meant(error: str, fault: Fault) -> bool:
    """Whether this is how the fault ends a run."""
    planted = PLANTED in error and fault.name == "bug of ours"
    return planted or (error == "cancelled" and fault.kills in {"controller", "task"})


def goes_on_again(evidence: Evidence) -> list[str]:
    """Another run does what it is to do, on nodes that are as the first has left them."""
    return [evidence.again] if evidence.again else []


def noted(evidence: Evidence) -> list[str]:
    """What happened is in the report, among its events or as its reason; and each EMCY that arrived."""
    if evidence.happened is None or evidence.report is None:
        return []
    if any(key == "verdict" and not verdict.accepted for key, verdict in evidence.notes):
        return []  # a command that was refused has not happened
    events = evidence.report.events
    texts = [*events, evidence.report.reason, evidence.report.learning.reason]
    fault = evidence.plan.fault
    problems = []
    if (
        fault.words
        and _in_time(evidence)
        and _shown(evidence)
        and not any(word in text for word in fault.words for text in texts)
    ):
        problems.append(f"not noted; noted were: {'; '.join(events) or 'nothing'}")
    if not fault.distorts:
        for frame in evidence.frames:
            code = int.from_bytes(frame.data[:2], "little")
            error = frame.can_id - EMCY in NODES and len(frame.data) == 8 and code & 0xFF00
            came = error and frame.arrived and frame.cycle >= 0
            if came and not any(f"{code:04X}h" in text for text in texts):
                problems.append(f"EMCY {code:04X}h of node {frame.can_id - EMCY} is not noted")
    return problems


def _shown(evidence: Evidence) -> bool:
    """Whether there was anything to be seen, and for long enough."""
    assert evidence.happened is not None
    fault = evidence.plan.fault
    if fault.while_led:
        return _led_at(evidence, evidence.happened[1] + fault.seen_cycles)
    causes = None if fault.cause is None else fault.cause(evidence)
    return causes is None or any(
        _lives(evidence, cause.cycle) and (cause.event != DRIFTED or _led_at(evidence, cause.cycle - 1))
        for cause in causes
    )


def _led_at(evidence: Evidence, cycle: int) -> bool:
    stage = max((at for at in evidence.stages if at[0] <= cycle), default=(0, 0))[1]
    return stage in LED_STAGES


def _in_time(evidence: Evidence) -> bool:
    """Whether the daemon lived long enough behind the fault to see it."""
    assert evidence.happened is not None
    return _lives(evidence, evidence.happened[1])


def _lives(evidence: Evidence, cycle: int) -> bool:
    last = evidence.frames[-1].cycle if evidence.frames else -1
    return last - cycle > evidence.plan.fault.seen_cycles


def recorded(evidence: Evidence) -> list[str]:
    """Every tick is recorded, to the last, or reported as lost; the values are those of the bus."""
    killed = evidence.folder / "killed-recording"
    if killed.exists():
        return _torn(killed, evidence)
    directory = evidence.folder / "recording"
    report = evidence.report
    if not evidence.ticks or (report is None and not directory.exists()):
        return []
    loss = re.search(r"(\d+) rows lost", report.reason) if report is not None else None
    if loss is not None or _full_at(evidence) is not None:
        return _of_full_disk(directory, evidence, None if loss is None else int(loss[1]))
    try:
        recording = load_recording(directory)
    except RecordingError as error:
        return [f"recording: {error}"]
    problems = []
    rows = len(recording.columns["cycle"])
    if rows != evidence.ticks:
        problems.append(f"recording: {rows} rows of {evidence.ticks} ticks")
    return problems + _as_reported(recording, evidence) + _as_sent(recording, evidence)


def _as_reported(recording: Recording, evidence: Evidence) -> list[str]:
    """Events, reason and completion of the recording are those of the report, where they could be written."""
    header, report = recording.header, evidence.report
    if report is None:
        return []
    problems = []
    if list(header.get("events", ())) != list(report.events):
        problems.append("recording: its events are not those of the report")
    if not report.reason.startswith(header.get("reason", "")) or header.get("completed") != report.completed:
        problems.append("recording: it did not end as the report says")
    return problems


def _full_at(evidence: Evidence) -> int | None:
    """Ticks before the disk was full; None: it never was."""
    second = evidence.second.notes if evidence.second is not None else {}
    ticks: int | None = (dict(evidence.notes) | second).get("full_ticks")
    return ticks


def _torn(directory: Path, evidence: Evidence) -> list[str]:
    """What a killed controller has left: all chunks that were full."""
    full = _full_at(evidence)
    whole = _whole(evidence.killed_ticks if full is None else min(full, evidence.killed_ticks))
    if not whole:
        return []
    try:
        rows = len(load_recording(directory).columns["cycle"])
    except RecordingError as error:
        return [f"recording of the killed: {error}"]
    return [f"recording of the killed: {rows} rows, {whole} were due"] if rows < whole else []


def _whole(ticks: int) -> int:
    """Rows of so many ticks in chunks that were full."""
    return ticks // ROWS_PER_PART * ROWS_PER_PART


def _of_full_disk(directory: Path, evidence: Evidence, lost: int | None) -> list[str]:
    """Check a recording on a full disk: rows due before are there, and each missing row is reported."""
    full = _full_at(evidence)
    due = 0 if full is None else _whole(full)
    problems = []
    try:
        recording = load_recording(directory)
        rows = len(recording.columns["cycle"])
        if recording.header["finished"]:
            problems = _as_reported(recording, evidence)
    except RecordingError as error:
        if due or "has no rows" not in str(error) or not any(words in str(error) for words in FULL):
            return [f"recording on a full disk: {error}"]
        rows = 0
    if rows < due:
        problems.append(f"recording on a full disk: {rows} rows, {due} were due")
    unsure = (
        0,
        ROWS_PER_PART,
    )  # a part that is there may be reported as lost: its folder could not be synced
    if lost is not None and rows + lost - evidence.ticks not in unsure:
        problems.append(f"recording: {rows} rows and {lost} lost of {evidence.ticks} ticks")
    return problems


def _as_sent(recording: Recording, evidence: Evidence) -> list[str]:
    """The statuswords recorded are those that were on the bus, cycle by cycle, up to the fault."""
    until = evidence.happened[1] - 1 if evidence.happened is not None else 10**9
    cycles = recording.columns["cycle"].astype(np.int64)
    shown = np.flatnonzero(np.diff(cycles, prepend=-1) == 1)  # ticks that were missed have no SYNC
    for axis, node in zip("xy", DRIVES, strict=True):
        column = recording.columns[f"{axis}.statusword"]
        sent = [
            int.from_bytes(f.data[:2], "little")
            for f in evidence.frames
            if f.can_id == TPDO + node and f.cycle >= 0 and f.sender == "nodes"
        ]
        count = min(len(sent), len(shown), max(until, 0))
        if list(column[:count].astype(np.int64)) != sent[:count]:
            return [f"recording: statuswords of axis {axis} are not those on the bus"]
    return []


def learned(evidence: Evidence, machine: MachineConfig) -> list[str]:
    """What was learned is whole: the version from before or a new one, never half of it."""
    problems = []
    for directory in (evidence.folder / "learned", evidence.folder / "killed-learned"):
        if not directory.exists():
            continue
        store = LearnedStore(directory, machine)
        for axis in machine.axes:
            try:
                active = store.active(axis)
            except StoreError as error:
                problems.append(f"learned: {error}")
                continue
            if active is None and not evidence.plan.fault.may_stop:
                problems.append(f"learned: nothing of axis {axis} is in use any more")
            if active is not None and not known(active.learned):
                problems.append(f"learned: version {active.version} of axis {axis} is none that was stored")
            problems += [f"learned: {v.problem}" for v in store.versions(axis) if v.problem]
            journal = directory / axis / JOURNAL_FILE
            if journal.exists() and not journal.read_bytes():
                problems.append("learned: an empty journal")
    return problems
