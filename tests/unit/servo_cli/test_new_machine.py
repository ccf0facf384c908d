"""A machine of one's own: asked for or given by flags, both files read, nodes held against their EDS."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from hil_sim.config.load import load_plant
from servo_ctrl.cli import conformance_request
from servo_ctrl.cli.main import app
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.machine_sheet import PROMPTS, AxisSheet
from servo_ctrl.conformance.scan import FoundNode

X = "x drive=1 scale=11 lead_mm=10 mass_kg=45 travel_mm=-100..100"
Z = "z drive=3 lead_mm=5 mass_kg=20 travel_mm=0..150"


def made(directory: Path, *arguments: str, typed: str = "", status: int = 0) -> str:
    result = CliRunner().invoke(app, ["new-machine", str(directory), *arguments], input=typed)
    assert result.exit_code == status, result.output
    return result.output


def test_every_answer_has_a_question() -> None:
    assert set(PROMPTS) == set(AxisSheet._fields) - {"name"}


def test_both_files_are_read_by_their_programs_and_describe_one_machine(tmp_path: Path) -> None:
    made(tmp_path / "mine", "--axis", X, "--axis", Z)
    machine, plant = load_machine(tmp_path / "mine"), load_plant(tmp_path / "mine")
    assert list(machine.axes) == list(plant.axes) == ["x", "z"]
    z, simulated = machine.axes["z"], plant.axes["z"]
    assert z.scale is None
    assert simulated.scale is None
    assert z.limits.position_mm == [0.0, 150.0]
    # 20 kg, and 0.6 kg cm^2 through a screw of 5 mm: (2 pi / 0.005)^2 * 6e-5 = 94.7 kg
    assert z.control.acceleration_feedforward_kg == pytest.approx(114.7, abs=0.1)
    assert simulated.table.mass_kg == 20.0
    text = (tmp_path / "mine" / "controller.toml").read_text()
    assert "# beyond it the machine stops" in text


def test_it_asks_again_until_an_answer_can_be_used(tmp_path: Path) -> None:
    answers = ["x", "one", "1", "", "10", "45", "", "100..-100", "-100..100", *[""] * 6, "", ""]
    output = made(tmp_path / "mine", typed="\n".join(answers) + "\n")
    assert "node id of the drive: expected a whole number, not 'one'" in output
    assert "expected the lower end, two dots, the upper end, not '100..-100'" in output
    assert load_machine(tmp_path / "mine").axes["x"].limits.position_mm == [-100.0, 100.0]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--axis", "x drive=1 lead_mm=10 mass_kg=45"], "axis x: travel_mm missing"),
        (["--axis", X.replace("scale=11", "scale=1")], "1 is given twice"),
        (["--axis", X.replace("drive=1", "drive=127")], "the controller's own"),
        (["--axis", X, "--axis", X.replace("drive=1", "drive=2")], "a name occurs twice"),
        (["--axis", X.replace("mass_kg=45", "mass_kg=-1")], "expected a number above 0"),
        (["--axis", X, "--drive-eds", "eds/linear_scale.eds"], "linear_scale.eds"),
        (["--from", "xy_table", "--axis", X], "leave out --axis"),
    ],
)
def test_what_cannot_be_is_refused_and_leaves_nothing(
    tmp_path: Path, arguments: list[str], reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.chdir(Path(__file__).parents[3])
    result = CliRunner().invoke(app, ["new-machine", str(tmp_path / "mine"), *arguments])
    assert result.exit_code != 0
    assert reason in result.output + str(result.exception)
    assert not (tmp_path / "mine").exists()


def test_nodes_on_the_bus_are_held_against_their_eds_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    foreign = FoundNode(1, 402, vendor=0x1234, product=None, revision=None, serial=None, name="other")

    async def nodes_on(_bus: str) -> list[FoundNode]:
        return [foreign]

    monkeypatch.setattr(conformance_request, "nodes_on", nodes_on)
    output = made(tmp_path / "mine", "--axis", X, "--bus", "localcan:/nowhere", status=1)
    assert "node   1  axis.x.drive: vendor-ID is 00001234h, servo_drive.eds says" in output
    assert "node  11  axis.x.scale: not on localcan:/nowhere" in output
