"""The Tuning page and the controller that makes its motions, both as they are, on a table in lockstep.

The bus is paced: else a motion may be over before the page has noticed that the visitor gave up control.
"""

from pathlib import Path
from typing import Any, cast

import pytest
from forked_program import commands_folder
from nicegui import ui
from nicegui.testing.user_simulation import user_simulation
from operated_table import operated
from page_in_process import PageInProcess

from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.shell.parts import configure_elements
from servo_ctrl.hmi.tuning import page as tuning
from servo_ctrl.hmi.tuning import page_tunings


async def test_the_table_moves_for_its_tuning_until_the_visitor_gives_up_control(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = str(commands_folder() / "servo-ctrl"), *page_tunings.ARGUMENTS
    monkeypatch.setattr(page_tunings, "installed_command", lambda: program)
    async with operated(bench, tmp_path, None, period_us=500, serve=True) as table, user_simulation() as user:
        configure_elements()
        page = PageInProcess(user, tmp_path, table.link)
        await table.until(lambda status: status.stage is Stage.READY)
        await page.show(tuning.build)
        (button,) = user.find(marker="tune-machine").elements
        await page.until(lambda: cast("ui.button", button).enabled)
        user.find(marker="tune-machine").click()
        await user.should_see("Move axis x of the machine?")
        user.find(marker="confirm").click()
        await table.until(lambda status: status.stage is Stage.RUNNING and status.program.step >= 1)
        await page.until(lambda: not cast("ui.button", button).enabled)
        page.release_control()
        await table.until(lambda status: status.stage is Stage.READY)
        await page.until(lambda: "cancelled" in page.text("job-state"))
        run = "local (configure, 127.0.0.1): tuning run x: refused: the tuning run of axis x has ended early"
        await table.until(lambda status: any(run in event.text for event in status.events))
        await table.stop()
