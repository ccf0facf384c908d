"""A day of one operator, from switching on to the stop, on one simulated table over the real bus."""

import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from live_page import go
from operator_improves import diagnose_and_accept, learn_and_see_j_fall, overlay_three_turns
from operator_moves import (
    LIMIT_MS,
    PART,
    expect_x_at_zero,
    load_the_circle,
    mend_and_load_the_part,
    run_circle,
    run_the_part,
    step_and_touch_off,
)
from operator_recovers import (
    kill_the_controller_and_go_on,
    kill_the_simulator_in_motion_and_go_on,
    stop_in_motion,
    take_over,
    write_an_object,
)
from playwright.sync_api import BrowserContext, Page, expect
from simulated_table import SHORT_CIRCLE, SHORT_LEARNING, ServedTable, opened, served_table, table_directory

from servo_ctrl.files.toml_text import toml_text


def rigid(plant: str) -> str:
    """The plant file without the drive trains' compliance, which is concealed from the day's diagnosis."""
    document = tomllib.loads(plant)
    for axis in document["axis"].values():
        del axis["drive_compliance"]
    return toml_text(document)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """Files of a table: a part program with an error, short learning, a nominal model that is too simple."""
    programs = {"circle.toml": SHORT_CIRCLE, "part.ngc": PART.replace("X4", "X400")}
    directory = table_directory(tmp_path / "table", SHORT_LEARNING, programs)
    plant = (directory / "plant.toml").read_text(encoding="utf-8")
    (directory / "rigid.toml").write_text(rigid(plant), encoding="utf-8")
    return directory


@pytest.fixture
def table(
    machine: Path, tmp_path: Path, environment: dict[str, str], free_port: Callable[[], int]
) -> Iterator[ServedTable]:
    """The simulated table under the real controller, its drives off."""
    with served_table(machine, tmp_path, free_port(), environment) as served:
        yield served


@pytest.mark.timeout(1800)
def test_a_day_of_an_operator(
    machine: Path,
    table: ServedTable,
    visiting: Callable[..., BrowserContext],
    picture: Callable[[Page, str], None],
) -> None:
    url = table.url
    page = opened(visiting(url), url)
    stage = page.get_by_test_id("stage")
    expect(stage).to_contain_text("Standby", timeout=LIMIT_MS)
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control-holder")).to_have_text("You have control")
    page.get_by_test_id("enable").click()
    expect(stage).to_contain_text("Ready", timeout=LIMIT_MS)
    expect(page.get_by_test_id("drive-state-x")).to_contain_text("under control")
    expect(page.get_by_test_id("drive-standard-x")).to_have_text("operation enabled")
    step_and_touch_off(page)
    picture(page, "operator_1_enabled")

    go(page, f"{url}/motion")
    mend_and_load_the_part(page)
    run_the_part(page, picture)
    expect_x_at_zero(page, url)

    load_the_circle(page, url)
    run_circle(page, url)
    picture(page, "operator_2_circle")
    learn_and_see_j_fall(page, url, picture)
    overlay_three_turns(page, url, picture)

    write_an_object(page, url, picture)
    go(page, f"{url}/motion")
    kill_the_simulator_in_motion_and_go_on(page, table)
    other = opened(visiting(url), url)
    take_over(page, other)
    kill_the_controller_and_go_on(table, page, other, picture)
    load_the_circle(page, url)
    run_circle(page, url)
    diagnose_and_accept(page, url, machine, picture)
    go(page, f"{url}/motion")
    stop_in_motion(page, url, picture)
