"""A proposal in the text of a machine file, and in the machine."""

import asyncio
import tomllib
from pathlib import Path

import pytest

from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.plant_of_axis import measured_model, section_of
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.modal_model import ModalModel, StructuralMode
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.tuning.machine_file import (
    MEASURED_PLANT,
    apply_to_file,
    digest_of,
    section_text,
    with_sections,
    with_values,
)
from servo_ctrl.tuning.request import TuneRequest
from servo_ctrl.tuning.simulated import tune_axis

SECTIONS = {
    "control": {
        "kp_1_s": 12.5,
        "kv_n_s_m": 9000.0,
        "ki_n_m": 1.0e5,
        "velocity_feedforward": 1.0,
        "acceleration_feedforward_kg": 71.0,
    },
    "notch": {"enabled": True, "frequency_hz": 41.0, "damping_ratio": 0.3, "depth": 0.2},
}


MEASURED = ModalModel(
    1e-3, 1.0 / 71.0, 1.0 / 72.0, 0.5, 1.5e-4, (StructuralMode(40.37, 0.0057, 3.2e-4, -0.0128),), 0.01
)


def read_from(file: Path, machines: Path) -> MachineConfig:
    """The X-Y table as if it had been read from this file as it is now."""
    table = load_machine(machines / "xy_table")
    return table.model_copy(update={"source": file, "source_sha256": digest_of(file)})


def test_the_text_with_the_values_is_the_machine_with_them(machines: Path, tmp_path: Path) -> None:
    source = machines / "xy_table" / "controller.toml"
    file = tmp_path / "machines" / "mine" / "controller.toml"
    file.parent.mkdir(parents=True)
    text = source.read_text(encoding="utf-8").replace("kp_1_s = 38.7\n", "kp_1_s = 38.7  # as published\n")
    file.write_text(text, encoding="utf-8")
    kept = apply_to_file(read_from(file, machines), "x", SECTIONS)
    assert kept.read_text(encoding="utf-8") == text
    written = file.read_text(encoding="utf-8")
    assert "kp_1_s = 12.5  # as published" in written
    assert written.count("[axis.x.notch]") == 1
    file.write_text(written.replace("../../eds", str(machines.parent / "eds")), encoding="utf-8")
    loaded = load_machine(file)
    expected = with_sections(load_machine(source), "x", SECTIONS)
    assert repr(axis_params(loaded, "x")) == repr(axis_params(expected, "x"))
    assert axis_params(loaded, "x").notch == notch.biquad(41.0, 0.3, 0.2, loaded.period_s)
    assert repr(axis_params(loaded, "y")) == repr(axis_params(load_machine(source), "y"))
    with pytest.raises(TuneError, match="from an earlier tuning"):
        apply_to_file(read_from(file, machines), "x", SECTIONS)


def test_the_measured_plant_is_in_the_file_and_read_again(machines: Path, tmp_path: Path) -> None:
    file = tmp_path / "machines" / "mine" / "controller.toml"
    file.parent.mkdir(parents=True)
    text = (machines / "xy_table" / "controller.toml").read_text(encoding="utf-8")
    file.write_text(text.replace("../../eds", str(machines.parent / "eds")), encoding="utf-8")
    sections = {**SECTIONS, MEASURED_PLANT: section_of(MEASURED).model_dump()}
    for _ in range(2):  # the second time its lines are replaced
        kept = apply_to_file(read_from(file, machines), "x", sections)
        kept.unlink()
    loaded = load_machine(file)
    found = measured_model(loaded, "x")
    assert found is not None
    assert found[:5] == pytest.approx(MEASURED[:5], rel=1e-5)
    assert found.modes[0] == pytest.approx(MEASURED.modes[0], rel=1e-5)
    assert loaded == with_sections(load_machine(file), "x", sections)
    assert file.read_text(encoding="utf-8").count("mode_hz = [40.37]") == 1
    assert tomllib.loads(section_text("x", sections))["axis"]["x"]["measured_plant"]["mode_hz"] == [40.37]


def test_the_line_ends_of_the_file_and_of_its_copy_stay(machines: Path, tmp_path: Path) -> None:
    file = tmp_path / "controller.toml"
    content = b"[axis.x.control]\r\nkp_1_s = 38.7  # as published\r\n"
    file.write_bytes(content)
    kept = apply_to_file(read_from(file, machines), "x", SECTIONS)
    assert kept.read_bytes() == content
    written = file.read_bytes()
    assert b"kp_1_s = 12.5  # as published\r\n" in written
    assert written.count(b"\n") == written.count(b"\r\n") == written.count(b"\r")


def test_values_are_not_put_into_a_file_that_was_changed_since_the_tuning_began(
    machines: Path, tmp_path: Path
) -> None:
    file = tmp_path / "controller.toml"
    file.write_text("[axis.x.control]\nkp_1_s = 38.7\n", encoding="utf-8")
    at_the_start = read_from(file, machines)
    changed = "[axis.x.control]\nkp_1_s = 20.0\n"
    file.write_text(changed, encoding="utf-8")
    with pytest.raises(TuneError, match="was changed while the axis was tuned"):
        apply_to_file(at_the_start, "x", SECTIONS)
    assert file.read_text(encoding="utf-8") == changed
    assert list(tmp_path.iterdir()) == [file]


def test_values_with_which_the_two_coupled_axes_have_no_margin_are_not_written(
    machines: Path, tmp_path: Path
) -> None:
    file = tmp_path / "controller.toml"
    file.write_text("[axis.x.control]\nkp_1_s = 38.7\n", encoding="utf-8")
    coupled = read_from(file, machines).model_copy(
        update={"contour_control": ContourControl(axes=["x", "y"], kp_1_s=55.0)}
    )
    stiffer = {**SECTIONS["control"], "kv_n_s_m": 21000.0}
    with pytest.raises(TuneError, match=r"would be refused, contour_control\.kp_1_s: with 55 1/s"):
        apply_to_file(coupled, "x", {"control": stiffer})
    assert file.read_text(encoding="utf-8") == "[axis.x.control]\nkp_1_s = 38.7\n"
    assert list(tmp_path.iterdir()) == [file]


def test_a_section_that_is_there_is_changed_in_its_place(machines: Path) -> None:
    text = (machines / "precision_stage" / "controller_cst.toml").read_text(encoding="utf-8")
    written = with_values(text, "x", SECTIONS)
    assert written.count("[axis.x.notch]") == 1
    assert "enabled = true  # against the arm that carries the reading head\nfrequency_hz = 41.0" in written
    assert written.index("[axis.x.notch]") < written.index("[axis.x.fuzzy_pd]")
    assert len(written.splitlines()) == len(text.splitlines()) + 2  # width and depth


@pytest.mark.parametrize(
    ("machine", "axis", "why"),
    [("xy_table", "z", "has no axis z, only x, y"), ("precision_stage", "x", "mode csp")],
)
def test_what_cannot_be_tuned_is_refused(machines: Path, machine: str, axis: str, why: str) -> None:
    config = load_machine(machines / machine)
    request = TuneRequest(config, axis, Path(), 2.0, None, show=lambda _: None, report_stage=print)
    with pytest.raises(TuneError, match=why):
        asyncio.run(tune_axis(request, "no bus:", "lockstep"))
