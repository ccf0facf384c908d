"""Recordings of motions by formula, in the format of a run."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kernels.arrays import Array
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.recorder import Recorder

PERIOD_S = 1e-3
AXES = ("x", "y")
COMPENSATION = {
    "feedback": "scale",
    "fuzzy_pd": False,
    "sampled_dual_loop": False,
    "pulse": True,
    "version": 3,
    "learned_at": "2026-11-20T09:00:00+00:00",
    "observer": False,
    "screw": False,
    "screw_version": 0,
    "screw_learned_at": "",
    "waveform": True,
    "waveform_version": 2,
    "waveform_learned_at": "2026-11-20T10:00:00+00:00",
}
LIMITS = {"velocity_m_s": 0.2, "force_n": 100.0, "following_error_m": 1e-3}
HEADER: dict[str, Any] = {
    "format": 1,
    "software": "servo_ctrl 0.1.0",
    "machine": "made_up",
    "axes": list(AXES),
    "period_s": PERIOD_S,
    "pacing": "lockstep",
    "started": "2026-11-21T09:30:00.000+00:00",
    "program": "programs/made_up.toml",
    "segments": [{"label": "step", "kind": "move"}],
    "finished": True,
    "completed": True,
    "reason": "",
    "events": ["axis x: something happened"],
    "missed_ticks": 0,
    "missing_inputs": 0,
    "nodes": [{"name": "axis.x.drive", "node_id": 1, "eds": "servo_drive.eds"}],
    "limits": dict.fromkeys(AXES, LIMITS),
    "monitoring": {"required_m": 4e-6, "window_s": 0.1},
    "compensation": dict.fromkeys(AXES, COMPENSATION),
}
SETUP_KEYS = ("nodes", "limits", "monitoring", "compensation")
"""Keys of the header that recordings of earlier versions lack."""


def write_recording(
    directory: Path,
    columns: Mapping[str, Array],
    reversals: Sequence[Mapping[str, Any]] | None = None,
    **header: Any,
) -> Path:
    """Write a recording; missing columns are 0, those of the scale equal the command."""
    count = len(next(iter(columns.values())))
    filled = {"time_s": np.arange(count) * PERIOD_S, "cycle": np.arange(count, dtype=np.float64), **columns}
    for axis in AXES:
        command_m = filled.setdefault(f"{axis}.position_command_m", np.zeros(count))
        scale_m = filled.setdefault(f"{axis}.scale_position_m", command_m)
        filled.setdefault(f"{axis}.position_error_m", command_m - scale_m)
    channels = channels_of(AXES)
    rows = np.column_stack([filled.get(channel.name, np.zeros(count)) for channel in channels])
    full_header = HEADER | header
    recorder = Recorder(directory, channels, full_header, rows_per_part=max(count, 1))
    for row in rows.tolist():
        recorder.record(row)
    recorder.close(full_header)
    if reversals is not None:
        lines = "".join(json.dumps(entry) + "\n" for entry in reversals)
        (directory / "reversals.jsonl").write_text(lines, encoding="utf-8")
    return directory


def reversal(axis: str, time_s: float, error_mean_m: float, *, due: bool = False) -> dict[str, Any]:
    """Return a line of reversals.jsonl."""
    return {
        "axis": axis,
        "cycle": round(time_s / PERIOD_S),
        "direction": 1,
        "acceleration_m_s2": 0.02,
        "contour_peak_m": 2.0 * error_mean_m,
        "error_peak_m": 3.0 * error_mean_m,
        "error_rms_m": 1.2 * error_mean_m,
        "error_mean_m": error_mean_m,
        "time_s": time_s,
        "due": due,
    }


def circle(deviation_m: Any, *, turns: float, direction: int = 1, samples: int = 2000) -> dict[str, Array]:
    """Return command and scale of a circle of 20 mm about (5, -3) mm, with a radial deviation by angle."""
    angle_rad = np.arange(round(turns * samples)) * (2.0 * np.pi * direction / samples)
    actual_m = 0.02 + deviation_m(angle_rad)
    return {
        "x.position_command_m": 5e-3 + 0.02 * np.cos(angle_rad),
        "y.position_command_m": -3e-3 + 0.02 * np.sin(angle_rad),
        "x.scale_position_m": 5e-3 + actual_m * np.cos(angle_rad),
        "y.scale_position_m": -3e-3 + actual_m * np.sin(angle_rad),
    }
