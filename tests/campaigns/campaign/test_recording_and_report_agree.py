"""Recording and report end at the same cycle, whatever happens while the recording is closed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from servo_ctrl.recording.reader import load_recording
from tests.campaigns.campaign import daemon_run, worker
from tests.campaigns.campaign.closing import while_closing
from tests.campaigns.campaign.draw import draw
from tests.campaigns.campaign.stand import Stand
from tests.campaigns.campaign.wire import NMT

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.daemon.run.report import RunReport

OVERRUN = 0x004, bytes((0, 1, 0, 0, 0, 0, 0, 0))


@pytest.fixture
def stand(tmp_path: Path) -> Stand:
    return Stand(worker.machine(), tmp_path, "lockstep")


def program_run(stand: Stand) -> RunReport:
    """Run the complete program without a fault."""
    ending = daemon_run.run_daemon(
        stand, daemon_run.faulty_run(draw(0)._replace(stand_by=False, pacing="lockstep"), stand)
    )
    assert ending.report is not None, ending
    return ending.report


def recorded_events(stand: Stand) -> tuple[list[str], str]:
    header = load_recording(stand.folder / "recording").header
    return header["events"], header["reason"]


@pytest.mark.parametrize("first", [True, False])
def test_frames_during_closing_are_in_neither_account(
    stand: Stand, monkeypatch: pytest.MonkeyPatch, *, first: bool
) -> None:
    def happen() -> None:
        stand.wire.error(*OVERRUN)
        stand.signal("SIGTERM")
        stand.daemon.note("somebody is at the page still")

    while_closing(monkeypatch, happen, first=first)
    report = program_run(stand)
    assert recorded_events(stand) == (list(report.events), report.reason) == ([], "")
    assert (report.completed, report.signal) == (True, "")


def test_frames_received_at_the_end_of_the_run_are_in_both_accounts(
    stand: Stand, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = stand.wire.from_controller

    def overrun_at_the_end(can_id: int, data: bytes) -> None:
        sent(can_id, data)
        if can_id == NMT and stand.ticks:
            stand.wire.error(*OVERRUN)

    monkeypatch.setattr(stand.wire, "from_controller", overrun_at_the_end)
    report = program_run(stand)
    assert report.events == ("bus localcan:campaign: receive overrun: frames were lost",)
    assert recorded_events(stand) == (list(report.events), report.reason)
