"""Recordings read back: an invalid or empty one is a one-line error with the reason."""

from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.recording import recorder as recorder_module
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import Recorder, RecordingError

CHANNELS = channels_of(["x"])
HEADER: dict[str, Any] = {"axes": ["x"], "segments": [{"label": "circle"}], "finished": False}


def test_full_disk_before_the_first_part_is_noted_in_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recorder_module, "write_part", full)
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER)
    recorder.record([0.0] * len(CHANNELS))
    with pytest.raises(RecordingError, match="1 rows lost"):
        recorder.close(HEADER | {"finished": True})
    reason = r"r: the recording has no rows: cannot be written: No space left on device \(1 rows lost\)"
    with pytest.raises(RecordingError, match=reason):
        load_recording(tmp_path / "r")


@pytest.mark.parametrize(
    ("files", "complaint"),
    [
        ({}, "is not a recording"),
        ({"recording.json": "{}"}, "has no rows: its run goes on .* or the disk was full"),
        ({"recording.json": '{"finished": true}'}, "has no rows: its run was over before its first cycle"),
        ({"recording.json": '{"loss": "the disk\\nwas full"}'}, "has no rows: the disk was full"),
        ({"recording.json": "{"}, "cannot be read"),
        ({"recording.json": "{}", "part-00000.parquet": "nonsense"}, "cannot be read"),
    ],
)
def test_an_invalid_recording_is_a_one_line_error(
    tmp_path: Path, files: dict[str, str], complaint: str
) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(RecordingError, match=complaint) as caught:
        load_recording(tmp_path)
    assert str(tmp_path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unknown_segment_lists_the_known_ones(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", CHANNELS, HEADER)
    recorder.record([0.0] * len(CHANNELS))
    recorder.close(HEADER)
    with pytest.raises(RecordingError, match="no segment 'cirle'; there are: circle"):
        load_recording(tmp_path / "r").segment("cirle")
