"""Summarises all runs of a soak, including those of earlier sessions."""

import json
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

from tests.campaigns.endurance.process_resources import FLAT_MIB_PER_H, slope
from tests.campaigns.endurance.soak import RunOutcome, Soak

ProgressLine = dict[str, Any]
SAMPLES_KEPT = 40
"""Bounds the samples of a run in the progress file, at equal distances; chosen."""
WEEK_S = 7 * 86_400
FLAT_OBJECTS_PER_H = 1000.0
"""Growth of Python objects that counts as none; chosen: a few hundred kB per hour."""


def progress_line(session: str, soak: Soak, outcome: RunOutcome) -> ProgressLine:
    """Return the line of a finished run in `progress.jsonl`."""
    step = max(1, len(outcome.samples) // SAMPLES_KEPT)
    return {
        "session": session,
        "pacing": soak.pacing,
        "machine": soak.machine.machine.name,
        **outcome.as_json(),
        "recorded_bytes": soak.recordings.bytes,
        "samples": [[s.machine_s, s.rss_mib, s.objects] for s in outcome.samples[::step]],
    }


def read_lines(file: Path) -> list[ProgressLine]:
    """Read the runs of earlier sessions, without an incomplete last line."""
    lines = []
    if file.exists():
        for text in file.read_text(encoding="utf-8").splitlines():
            try:
                lines.append(json.loads(text))
            except ValueError:
                continue
    return lines


def summary(lines: list[ProgressLine]) -> dict[str, Any]:
    """Return the summary of all runs of one pacing."""
    machine_s = sum(line["machine_s"] for line in lines)
    wall_s = sum(line["wall_s"] for line in lines)
    totals: Counter[str] = Counter()
    for line in lines:
        run_counts = line["books"]
        totals.update(
            {key: run_counts[key] for key in ("cycles", "missed_ticks", "rows", "rows_lost", "syncs")}
        )
        totals.update({f"set points {key}h": count for key, count in run_counts["set_points"].items()})
        totals.update({f"answers {key}h": count for key, count in run_counts["answers"].items()})
    totals["missing_inputs"] = sum(line["missing_inputs"] for line in lines)
    speed = machine_s / wall_s if wall_s else 0.0
    return {
        "runs": len(lines),
        "sessions": len({line["session"] for line in lines}),
        "machine_h": machine_s / 3600.0,
        "wall_h": wall_s / 3600.0,
        "times_real_time": speed,
        "a_week_takes_h": WEEK_S / speed / 3600.0 if speed else None,
        "counts": dict(totals),
        "recorded_mib_per_h": _recorded_bytes(lines) / 2**20 / max(machine_s / 3600.0, 1e-9),
        "memory_mib_per_h": memory_growth(lines),
        "objects_per_h": object_growth(lines),
        "stopped": dict(Counter(line["stopped"] for line in lines if line["stopped"])),
        "faults": [fault for line in lines for fault in line["faults"]],
    }


def memory_growth(lines: list[ProgressLine]) -> dict[str, Any]:
    """Return the growth of memory by role over machine time in the longest session, a set of processes."""
    session = _longest_session(lines)
    hours: list[float] = []
    values: dict[str, list[float]] = defaultdict(list)
    offset_h = 0.0
    for line in lines:
        if line["session"] != session:
            continue
        for at_s, rss_mib, _ in line["samples"]:
            hours.append(offset_h + at_s / 3600.0)
            for role, mib in rss_mib.items():
                values[role].append(mib)
        offset_h += line["machine_s"] / 3600.0
    return {
        role: {
            "first_mib": series[0],
            "last_mib": series[-1],
            "highest_mib": max(series),
            **slope(hours, series).as_json(FLAT_MIB_PER_H),
        }
        for role, series in values.items()
    }


def object_growth(lines: list[ProgressLine]) -> dict[str, Any]:
    """Return the growth of the controller's objects in the longest run, which has no collector."""
    longest = max(lines, key=lambda line: line["machine_s"], default=None)
    if longest is None:
        return {}
    cycling = [(at_s / 3600.0, count) for at_s, _, count in longest["samples"] if at_s > 0.0]
    hours = [hour for hour, _ in cycling]
    return slope(hours, [float(count) for _, count in cycling]).as_json(FLAT_OBJECTS_PER_H)


def _longest_session(lines: list[ProgressLine]) -> str:
    by_session: Counter[str] = Counter()
    for line in lines:
        by_session[line["session"]] += line["machine_s"]
    return by_session.most_common(1)[0][0] if by_session else ""


def _recorded_bytes(lines: list[ProgressLine]) -> int:
    """Return the bytes of all recordings; each line has the sum of its session so far."""
    last: dict[str, int] = {}
    for line in lines:
        last[line["session"]] = line["recorded_bytes"]
    return sum(last.values())
