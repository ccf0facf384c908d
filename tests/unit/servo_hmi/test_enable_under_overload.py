"""A computer that misses ticks: Enable asks first, and sends nothing before the answer."""

import pytest
from page_in_process import PageInProcess

from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.drive import page as drive


@pytest.mark.parametrize(("answer", "stage"), [("confirm", Stage.READY), ("leave-it", Stage.STANDBY)])
async def test_enable_asks_while_ticks_are_missed(
    shown_page: PageInProcess, answer: str, stage: Stage
) -> None:
    link, user = shown_page.link, shown_page.user
    link.change(stage=Stage.STANDBY, cycles=1000, missed_ticks=0)
    await shown_page.show(drive.build)
    link.change(cycles=5000, missed_ticks=2000, reason="stopped by the test")
    await shown_page.until(lambda: shown_page.shows("stopped by the test"))
    user.find(marker="enable").click()
    await shown_page.until(lambda: shown_page.shows("The computer misses 50 % of the ticks"))
    assert link.requests == []
    user.find(marker=answer).click()
    await shown_page.until(
        lambda: not shown_page.shows("Enable nevertheless?") and link.status.stage is stage
    )
