"""The recording of the last demo has one path, whatever its time: README's next command names it."""

from pathlib import Path

from servo_ctrl.cli.demo import newest


def test_the_link_leads_to_the_last_recording(tmp_path: Path) -> None:
    link = tmp_path / "recording"
    for name in ("circles-1", "circles-2"):
        recording = tmp_path / "recordings" / name
        recording.mkdir(parents=True)
        assert newest(recording, link) == link
        assert link.resolve() == recording
    moved = tmp_path.rename(tmp_path.with_name("moved"))
    assert (moved / "recording").resolve() == moved / "recordings" / "circles-2"


def test_what_the_user_has_by_that_name_is_left_alone(tmp_path: Path) -> None:
    recording, own = tmp_path / "recordings" / "circles-1", tmp_path / "recording"
    recording.mkdir(parents=True)
    own.mkdir()
    assert newest(recording, own) == recording
    assert not own.is_symlink()
