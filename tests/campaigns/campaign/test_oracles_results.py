"""The oracle of recordings: what it detects, and what it accepts on a full disk."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import HEADER_FILE
from tests.campaigns.campaign import oracles_results
from tests.campaigns.campaign.stand import ROWS_PER_PART
from tests.campaigns.campaign.test_oracles import verdict_of

if TYPE_CHECKING:
    from tests.campaigns.campaign.run import Evidence
    from tests.campaigns.campaign.wire import Frame


def test_recording_without_its_last_chunk(evidence: Evidence) -> None:
    assert not oracles_results.recording_complete(evidence)
    max((evidence.folder / "recording").glob("part-*.parquet")).unlink()
    assert "rows of" in verdict_of(oracles_results.recording_complete, evidence)


def test_recording_with_a_torn_chunk(evidence: Evidence) -> None:
    part = max((evidence.folder / "recording").glob("part-*.parquet"))
    part.write_bytes(part.read_bytes()[:-40])
    assert "cannot be read" in verdict_of(oracles_results.recording_complete, evidence)


def test_recording_of_other_values_than_those_on_the_bus(evidence: Evidence) -> None:
    def other(frame: Frame) -> Frame:
        return frame._replace(data=b"\x99" + frame.data[1:]) if frame.can_id == 0x182 else frame

    begun = [other(frame) if frame.cycle == 30 else frame for frame in evidence.frames]
    assert "axis y are not those" in verdict_of(
        oracles_results.recording_complete, evidence._replace(frames=begun)
    )


def test_recording_of_a_killed_controller_without_a_chunk_that_was_full(evidence: Evidence) -> None:
    (evidence.folder / "recording").rename(evidence.folder / "killed-recording")
    killed = evidence._replace(killed_ticks=evidence.ticks)
    assert not oracles_results.recording_complete(killed)
    min((evidence.folder / "killed-recording").glob("part-*.parquet")).unlink()
    assert "were due" in verdict_of(oracles_results.recording_complete, killed)


def without_rows(evidence: Evidence, loss: str = "") -> None:
    """Leave a recording as a full disk does whose first part did not fit."""
    directory = evidence.folder / "recording"
    for part in directory.glob("part-*.parquet"):
        part.unlink()
    header = json.loads((directory / HEADER_FILE).read_text(encoding="utf-8")) | {"finished": False}
    (directory / HEADER_FILE).write_text(json.dumps(header | ({"loss": loss} if loss else {})))


@pytest.mark.parametrize("loss", ["", "cannot be written: No space left on device (88 rows lost)"])
def test_recording_without_rows_is_right_only_where_the_disk_was_full_before_a_part_was_due(
    evidence: Evidence, loss: str
) -> None:
    without_rows(evidence, loss)
    torn = evidence._replace(report=None)
    assert "has no rows" in verdict_of(oracles_results.recording_complete, torn)
    assert oracles_results.recording_complete(torn._replace(notes=(("full_ticks", ROWS_PER_PART - 1),))) == []
    promised = torn._replace(notes=(("full_ticks", ROWS_PER_PART),))
    assert "has no rows" in verdict_of(oracles_results.recording_complete, promised)


def test_recording_without_rows_with_another_reason(evidence: Evidence) -> None:
    without_rows(evidence, "the disk was too slow, 88 rows lost")
    full = evidence._replace(report=None, notes=(("full_ticks", 40),))
    assert "too slow" in verdict_of(oracles_results.recording_complete, full)


def test_missing_rows_beyond_those_reported(evidence: Evidence) -> None:
    report, notes = evidence.report, (("full_ticks", ROWS_PER_PART),)
    assert report is not None
    directory = evidence.folder / "recording"
    max(directory.glob("part-*.parquet")).unlink()
    lost = evidence.ticks - len(load_recording(directory).columns["cycle"])
    right, unsure, fewer, more = (
        evidence._replace(notes=notes, report=report.with_problem(f"cannot be written ({count} rows lost)"))
        for count in (lost, lost + ROWS_PER_PART, lost - 1, lost + 1)
    )
    assert oracles_results.recording_complete(right) == oracles_results.recording_complete(unsure) == []
    assert f"{lost - 1} lost of" in verdict_of(oracles_results.recording_complete, fewer)
    assert f"{lost + 1} lost of" in verdict_of(oracles_results.recording_complete, more)
    for part in directory.glob("part-*.parquet"):
        part.unlink()
    assert "has no rows" in verdict_of(oracles_results.recording_complete, right)


@pytest.mark.parametrize("other", [{"events": []}, {"reason": "nothing"}, {"completed": True}])
def test_recording_with_another_end_than_the_report(evidence: Evidence, other: dict[str, Any]) -> None:
    file = evidence.folder / "recording" / HEADER_FILE
    file.write_text(json.dumps(json.loads(file.read_text(encoding="utf-8")) | other))
    assert "the report" in verdict_of(oracles_results.recording_complete, evidence)
