"""A report in the operator's words: clock time beside events, and micrometres with their own letter."""

import re
from pathlib import Path

import numpy as np
import pytest
from synthetic_recording import circle, reversal, write_recording

from servo_ctrl.report.content import ReportTable
from servo_ctrl.report.html_page import page
from servo_ctrl.report.recorded_run import read_run
from servo_ctrl.report.write import report_of


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TZ", "UTC")
    return write_recording(
        tmp_path / "r",
        circle(lambda a: 2e-6 * np.cos(4 * a), turns=1.2),
        [reversal("x", 0.5, 3e-6)],
        events=["the machine is ready", "axis x: following error of 12 um"],
        event_cycles=[0, 1500],
        first_sync="2026-11-21T09:30:00.000+00:00",
    )


def test_an_event_has_its_clock_time_beside_the_time_of_the_run(recording: Path) -> None:
    report = report_of(read_run(recording))
    [events] = [section for section in report.sections if section.heading == "Faults and events"]
    [table] = [block for block in events.parts if isinstance(block, ReportTable)]
    clocks, times = [row[0] for row in table.rows], [row[1] for row in table.rows]
    assert times == ["0.000", "1.500"]
    assert all(re.fullmatch(r"\d\d:\d\d:\d\d", clock) for clock in clocks)
    assert int(clocks[1][-2:]) - int(clocks[0][-2:]) == 1


def test_micrometres_have_their_own_letter(recording: Path) -> None:
    text = re.sub("<script.*?</script>", "", page(report_of(read_run(recording))), flags=re.DOTALL)
    assert "\N{MICRO SIGN}m" in text
    assert not re.search(r"\d um\b|\(um\)|\bum<", text)
