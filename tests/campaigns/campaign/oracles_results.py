"""Oracles of the end of a run, its events, its recording and its learned results."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.learned.store import LearnedStore, StoreError
from servo_ctrl.learned.stroke_journal import JOURNAL_FILE
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import RecordingError
from tests.campaigns.campaign.causes import SENSORS_DISAGREE
from tests.campaigns.campaign.fault_context import DRIVES, NODES
from tests.campaigns.campaign.learning import is_stored_result
from tests.campaigns.campaign.stand import ROWS_PER_PART

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.recording.reader import Recording
    from tests.campaigns.campaign.fault_context import Fault
    from tests.campaigns.campaign.run import Evidence

TPDO = 0x180
CONTROLLED_STAGES = (2, 3, 4)
"""Stages ready, running and stopping, in which the controller controls the axes."""
EMCY = 0x080
RECEIVED_AFTER = 300
"""Ticks after which a broker has received a message."""
PLANTED = "planted by the campaign"
DISK_FULL_TEXTS = ("the disk was full", "No space left on device")


def ended_as_intended(evidence: Evidence) -> list[str]:
    """The run ended, and as the fault intends."""
    problems = []
    if ("published", 0) in evidence.notes and evidence.ticks > RECEIVED_AFTER:
        problems.append("the broker had received nothing before it went")
    if evidence.stuck:
        problems.append(f"stuck: {evidence.stuck}")
    error, fault = evidence.error, evidence.plan.fault
    if error.startswith("refused: "):
        if evidence.plan.state != "booting":
            problems.append(f"the run was refused, and not while booting: {error}")
    elif error and not _is_intended(error, fault):
        problems.append(f"the run ended by {error}")
    return problems


def _is_intended(error: str, fault: Fault) -> bool:
    """Return whether the fault is meant to end the run by this error."""
    planted = PLANTED in error and fault.name == "bug of ours"
    return planted or (error == "cancelled" and fault.kills in {"controller", "task"})


def next_run_succeeds(evidence: Evidence) -> list[str]:
    """Another run succeeds on the nodes in the state after the first."""
    return [evidence.next_run_problem] if evidence.next_run_problem else []


def reported(evidence: Evidence) -> list[str]:
    """The report has the fault, among its events or as its reason, and each EMCY that arrived."""
    if evidence.injected is None or evidence.report is None:
        return []
    if any(key == "verdict" and not verdict.accepted for key, verdict in evidence.notes):
        return []  # a refused command has no effect
    events = evidence.report.events
    texts = [*events, evidence.report.reason, evidence.report.learning.reason]
    fault = evidence.plan.fault
    problems = []
    if (
        fault.words
        and _lived_long_enough(evidence, evidence.injected.cycle)
        and _is_detectable(evidence)
        and not any(word in text for word in fault.words for text in texts)
    ):
        problems.append(f"not reported; reported were: {'; '.join(events) or 'nothing'}")
    if not fault.changes_frames:
        for frame in evidence.frames:
            code = int.from_bytes(frame.data[:2], "little")
            error = frame.can_id - EMCY in NODES and len(frame.data) == 8 and code & 0xFF00
            has_arrived = error and frame.arrived and frame.cycle >= 0
            if has_arrived and not any(f"{code:04X}h" in text for text in texts):
                problems.append(f"EMCY {code:04X}h of node {frame.can_id - EMCY} is not reported")
    return problems


def _is_detectable(evidence: Evidence) -> bool:
    """Return whether the fault was detectable, and for long enough."""
    assert evidence.injected is not None
    fault = evidence.plan.fault
    if fault.while_controlled:
        return _controlled_at(evidence, evidence.injected.cycle + fault.reported_within_cycles)
    causes = None if fault.cause is None else fault.cause(evidence)
    return causes is None or any(
        _lived_long_enough(evidence, cause.cycle)
        and (cause.event != SENSORS_DISAGREE or _controlled_at(evidence, cause.cycle - 1))
        for cause in causes
    )


def _controlled_at(evidence: Evidence, cycle: int) -> bool:
    stage = max((at for at in evidence.stages if at[0] <= cycle), default=(0, 0))[1]
    return stage in CONTROLLED_STAGES


def _lived_long_enough(evidence: Evidence, cycle: int) -> bool:
    """Return whether the daemon ran long enough after a cycle to detect a fault of it."""
    last = evidence.frames[-1].cycle if evidence.frames else -1
    return last - cycle > evidence.plan.fault.reported_within_cycles


def recording_complete(evidence: Evidence) -> list[str]:
    """Every tick has a row or is reported as lost, and the values are those of the bus."""
    killed = evidence.folder / "killed-recording"
    if killed.exists():
        return _killed_recording(killed, evidence)
    directory = evidence.folder / "recording"
    report = evidence.report
    if not evidence.ticks or (report is None and not directory.exists()):
        return []
    lost_rows = re.search(r"(\d+) rows lost", report.reason) if report is not None else None
    if lost_rows is not None or _full_at(evidence) is not None:
        return _recording_on_full_disk(directory, evidence, None if lost_rows is None else int(lost_rows[1]))
    try:
        recording = load_recording(directory)
    except RecordingError as error:
        return [f"recording: {error}"]
    problems = []
    rows = len(recording.columns["cycle"])
    if rows != evidence.ticks:
        problems.append(f"recording: {rows} rows of {evidence.ticks} ticks")
    return (
        problems + _differences_from_report(recording, evidence) + _differences_from_bus(recording, evidence)
    )


def _differences_from_report(recording: Recording, evidence: Evidence) -> list[str]:
    """Return differences of events, reason and completion between recording and report."""
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
    """Return the ticks before the disk was full; None = it never was."""
    second = evidence.second.notes if evidence.second is not None else {}
    ticks: int | None = (dict(evidence.notes) | second).get("full_ticks")
    return ticks


def _killed_recording(directory: Path, evidence: Evidence) -> list[str]:
    """Check the recording of a killed controller: all full parts are there."""
    full = _full_at(evidence)
    due_rows = _rows_of_full_parts(
        evidence.killed_ticks if full is None else min(full, evidence.killed_ticks)
    )
    if not due_rows:
        return []
    try:
        rows = len(load_recording(directory).columns["cycle"])
    except RecordingError as error:
        return [f"recording of the killed: {error}"]
    return [f"recording of the killed: {rows} rows, {due_rows} were due"] if rows < due_rows else []


def _rows_of_full_parts(ticks: int) -> int:
    """Return the rows of these ticks that are in full parts."""
    return ticks // ROWS_PER_PART * ROWS_PER_PART


def _recording_on_full_disk(directory: Path, evidence: Evidence, lost: int | None) -> list[str]:
    """Check a recording on a full disk: rows due before are there, and each missing row is reported."""
    full = _full_at(evidence)
    due = 0 if full is None else _rows_of_full_parts(full)
    problems = []
    try:
        recording = load_recording(directory)
        rows = len(recording.columns["cycle"])
        if recording.header["finished"]:
            problems = _differences_from_report(recording, evidence)
    except RecordingError as error:
        if (
            due
            or "has no rows" not in str(error)
            or not any(words in str(error) for words in DISK_FULL_TEXTS)
        ):
            return [f"recording on a full disk: {error}"]
        rows = 0
    if rows < due:
        problems.append(f"recording on a full disk: {rows} rows, {due} were due")
    # a part may be there and reported as lost, because its directory could not be synchronised
    possible_surplus = (0, ROWS_PER_PART)
    if lost is not None and rows + lost - evidence.ticks not in possible_surplus:
        problems.append(f"recording: {rows} rows and {lost} lost of {evidence.ticks} ticks")
    return problems


def _differences_from_bus(recording: Recording, evidence: Evidence) -> list[str]:
    """Return differences between recorded statuswords and those on the bus up to the fault."""
    until = evidence.injected.cycle - 1 if evidence.injected is not None else 10**9
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
    """Each learned result is complete: an earlier version or a new one."""
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
            if active is not None and not is_stored_result(active.learned):
                problems.append(f"learned: version {active.version} of axis {axis} is none that was stored")
            problems += [f"learned: {v.problem}" for v in store.versions(axis) if v.problem]
            journal = directory / axis / JOURNAL_FILE
            if journal.exists() and not journal.read_bytes():
                problems.append("learned: an empty journal")
    return problems
