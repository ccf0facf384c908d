"""The sections of the run: machine, program, start, end, nodes, compensation in use, events."""

import json
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from servo_ctrl.commands.texts import on_off
from servo_ctrl.metrology.contour_error import CONTOUR_FILE
from servo_ctrl.report.content import ReportSection, ReportTable
from servo_ctrl.report.header import CompensationInUse, RecordingHeader
from servo_ctrl.report.recorded_run import RecordedRun
from servo_ctrl.units import with_signs

MOST_EVENTS = 200


def verdict(header: RecordingHeader) -> tuple[str, bool, str]:
    """Return the verdict in one or two words, whether it is good, and its reason."""
    if not header.finished:
        return "not closed", False, "The recording was not closed: the controller or its computer stopped."
    if header.completed:
        return "completed", True, "The program was run to its end."
    reason = with_signs(header.reason) or "no reason was recorded"
    return "stopped", False, f"It ended early: {reason}."


def run_sections(run: RecordedRun) -> list[ReportSection]:
    """Return the run and its events, then the machine and its compensation."""
    header = run.header
    sections = [ReportSection("The run", (), (_facts(run),)), _events(header)]
    parts = tuple(table for table in (_compensation(header), _nodes(header)) if table is not None)
    text = () if parts else ("The recording does not tell: it was made by an earlier version.",)
    return [*sections, ReportSection("Machine and compensation", text, parts)]


def contour_section(run: RecordedRun) -> ReportSection | None:
    """Return the contour error of a part program; None without a usable file of it."""
    path = run.directory / CONTOUR_FILE
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    names = {
        "to_program": "table to the geometry as written",
        "to_command": "table to the commanded path",
        "rounding": "commanded path to the geometry",
    }
    rows = []
    for key, name in names.items():
        figures: Any = found.get(key) if isinstance(found, dict) else None
        if not isinstance(figures, dict):
            return None
        cells = [figures.get(what) for what in ("rms_um", "p99_um", "max_um")]
        if not all(isinstance(cell, float | int) for cell in cells):
            return None
        rows.append((name, *(f"{cell:.2f}" for cell in cells), str(figures.get("line", ""))))
    head = ("distance", "RMS µm", "99 % below µm", "largest µm", "in line")
    return ReportSection(
        "Contour error of the part program", (), (ReportTable("At feed", head, tuple(rows)),)
    )


def _facts(run: RecordedRun) -> ReportTable:
    header = run.header
    ran = {index for index, *_ in run.steps()}
    duration_s = (int(run.cycle[-1]) - int(run.cycle[0]) + 1) * header.period_s
    gaps = int(np.sum(np.diff(run.cycle) - 1))
    rows = (
        ("machine", header.machine),
        ("axes", ", ".join(header.axes)),
        ("program", header.program or "none"),
        ("steps run", f"{len(ran)} of {len(header.segments)}"),
        ("started", _when(header.started)),
        ("duration", f"{duration_s:.3f} s of machine time, {len(run.time_s)} rows"),
        ("cycle", f"{header.period_s * 1e3:g} ms, {header.pacing}"),
        ("missed ticks", _count(header.missed_ticks, gaps)),
        ("missing inputs", _count(header.missing_inputs, None)),
        ("software", header.software),
        ("recording", str(run.directory)),
    )
    lost = (("not recorded", header.loss),) if header.loss else ()
    return ReportTable("What ran", ("", ""), rows + lost, words=2)


def _count(counted: int | None, gaps: int | None) -> str:
    if counted is None:
        return "not recorded" if gaps is None else f"not recorded; {gaps} cycles without a row"
    return str(counted) if not gaps else f"{counted}; {gaps} cycles without a row"


def _when(started: str) -> str:
    try:
        return datetime.fromisoformat(started).strftime("%Y-%m-%d %H:%M:%S %Z")
    except ValueError:
        return started


def _time_of(header: RecordingHeader, number: int) -> tuple[str, str]:
    """Clock time and time of the run of an event; recordings of earlier versions have neither."""
    if number >= len(header.event_cycles):
        return "", ""
    run_s = header.event_cycles[number] * header.period_s
    try:
        clock = (datetime.fromisoformat(header.first_sync) + timedelta(seconds=run_s)).astimezone()
    except ValueError:
        return "", f"{run_s:.3f}"
    return clock.strftime("%H:%M:%S"), f"{run_s:.3f}"


def _events(header: RecordingHeader) -> ReportSection:
    if not header.events:
        unknown = "Unknown: they are written when a recording is closed."
        return ReportSection("Faults and events", ("None." if header.finished else unknown,))
    shown = header.events[:MOST_EVENTS]
    rest = len(header.events) - len(shown)
    rows = tuple((*_time_of(header, number), with_signs(event)) for number, event in enumerate(shown))
    note = f"and {rest} more in recording.json" if rest else ""
    return ReportSection(
        "Faults and events",
        (),
        (ReportTable("In their order", ("clock", "time of the run s", "event"), rows, 3, note),),
    )


def _nodes(header: RecordingHeader) -> ReportTable | None:
    if not header.nodes:
        return None
    rows = tuple((str(node.node_id), node.name, node.eds) for node in header.nodes)
    return ReportTable("Nodes", ("node id", "what", "EDS"), rows, words=3)


def _compensation(header: RecordingHeader) -> ReportTable | None:
    if not header.compensation:
        return None
    rows = tuple((name, *_in_use(used)) for name, used in header.compensation.items())
    head = (
        "axis",
        "position loop",
        "friction pulse",
        "learned waveform",
        "observer",
        "screw and lost motion",
        "sampled dual loop",
    )
    return ReportTable("Compensation in use, at the end of the run", head, rows, words=7)


def _in_use(used: CompensationInUse) -> tuple[str, ...]:
    law = "fuzzy-PD" if used.fuzzy_pd else "PID"
    return (
        f"{law} on the {used.feedback}",
        _learned(used.version, used.learned_at, on=used.pulse),
        _learned(used.waveform_version, used.waveform_learned_at, on=used.waveform),
        on_off(used.observer),
        _learned(used.screw_version, used.screw_learned_at, on=used.screw),
        on_off(used.sampled_dual_loop),
    )


def _learned(version: int, learned_at: str, *, on: bool) -> str:
    if not version:
        return "on, but nothing learned" if on else "off"
    return f"{on_off(on)}, version {version} of {_when(learned_at)}"
