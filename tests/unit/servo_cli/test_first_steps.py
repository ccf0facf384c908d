"""What a new user types first: version, help, completion, a file of the wrong kind."""

import re
from importlib.metadata import version
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner

from hil_sim.cli.main import app as hil_sim_app
from hil_sim.config.load import ConfigError as PlantError
from hil_sim.config.load import load_plant
from reconcile.cli.main import app as reconcile_app
from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import load_model
from servo_ctrl.cli.demo import FIRST_CLICKS
from servo_ctrl.cli.main import app
from servo_ctrl.cli.operator_page import page_at
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.errors import ConfigError, ServoCtrlError
from servo_ctrl.hmi.app import PAGES

TABLE = Path(__file__).parents[3] / "machines" / "xy_table"


def printed(*arguments: str, **environment: str) -> str:
    result = CliRunner().invoke(app, list(arguments), prog_name="servo-ctrl", env=environment)
    assert result.exit_code == 0, result.output
    return result.output


def test_the_version_is_that_of_the_package() -> None:
    assert printed("--version") == f"servo-ctrl {version('servo-ctrl')}\n"


@pytest.mark.parametrize("command", [[], ["run"], ["learned"], ["learned", "show"], ["demo"]])
def test_help_shows_flags_without_a_type(command: list[str]) -> None:
    text = printed(*command, "--help")
    assert "--help" in text
    assert "<bool>" not in text


def test_a_demo_without_the_library_of_the_page_says_what_the_bench_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def seen_enough(*_arguments: object, **_options: object) -> None:
        raise ServoCtrlError

    monkeypatch.setattr("servo_ctrl.cli.operator_page.page_installed", lambda: False)
    monkeypatch.setattr("servo_ctrl.hil_rig.simulated_run.simulated_run", seen_enough)
    result = CliRunner().invoke(app, ["demo", "--machine", str(TABLE), "--out", str(tmp_path)])
    assert "pip install 'servo-ctrl[hmi]'" in result.output


def test_help_shows_how_a_simulator_is_run_in_lockstep() -> None:
    assert "lockstep" in printed("--help")


@pytest.mark.parametrize(
    ("program", "name", "begun", "offered"),
    [
        (app, "servo-ctrl", "le", ["learn", "learned"]),
        (hil_sim_app, "hil-sim", "ru", ["run"]),
        (reconcile_app, "reconcile", "diag", ["diagnose"]),
    ],
)
def test_the_shell_completes_a_command(program: Typer, name: str, begun: str, offered: list[str]) -> None:
    variable = f"_{name.upper().replace('-', '_')}_COMPLETE"
    words = {"COMP_WORDS": f"{name} {begun}", "COMP_CWORD": "1", variable: "complete_bash"}
    result = CliRunner().invoke(program, prog_name=name, env=words)
    assert result.exit_code == 0, result.output
    assert result.output.split() == offered


def test_a_file_of_the_wrong_kind_is_named_as_what_it_is() -> None:
    machine = load_machine(TABLE)
    program = TABLE / "programs" / "circles.toml"
    with pytest.raises(ConfigError, match="this is the plant file of a simulator, --machine takes"):
        load_machine(TABLE / "plant.toml")
    with pytest.raises(ConfigError, match="this is a program, --machine takes"):
        load_machine(program)
    with pytest.raises(ConfigError, match="this is a controller file, --program takes"):
        load_program(TABLE / "controller.toml", machine)
    with pytest.raises(ConfigError, match="this is a directory, --program takes"):
        load_program(TABLE, machine)
    with pytest.raises(ConfigError, match="this is an EDS file"):
        load_machine(TABLE.parents[1] / "eds" / "servo_drive.eds")
    with pytest.raises(PlantError, match="this is a controller file, --machine takes"):
        load_plant(TABLE / "controller.toml")
    with pytest.raises(ReconcileError, match="this is a controller file, --model wants the plant file"):
        load_model(TABLE / "controller.toml")


@pytest.mark.parametrize(
    ("program", "commands"), [(hil_sim_app, ["run"]), (reconcile_app, ["diagnose", "watch"])]
)
def test_the_other_programs_print_their_version_and_show_flags_without_a_type(
    program: Typer, commands: list[str]
) -> None:
    output = CliRunner().invoke(program, ["--version"]).output
    assert output.split()[1:] == [version("servo-ctrl")]
    for command in commands:
        assert "<bool>" not in CliRunner().invoke(program, [command, "--help"]).output


def test_the_demo_ends_with_what_to_click_first() -> None:
    pages = {module.TITLE for module in PAGES.values()}
    clicks = FIRST_CLICKS.splitlines()
    assert clicks[0].startswith("first: Take control")
    assert "Enable on page Drive" in clicks[0]
    assert set(re.findall(r"page (\w+)", FIRST_CLICKS)) <= pages


@pytest.mark.parametrize("address", ["8080", "0.0.0.0:8080"])
def test_a_message_names_the_flag_that_was_typed(address: str) -> None:
    with pytest.raises(ConfigError, match="--hmi") as refused:
        page_at(address)
    assert "--listen" not in str(refused.value)
    assert "--access" not in str(refused.value)
