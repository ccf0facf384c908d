"""`[contour_control]`: off by default, in SI, refused without a margin."""

from pathlib import Path

import pytest
from machine_files import XY_TABLE, text_of

from servo_ctrl.config.contour import couplings, sensitivity_peak_of
from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.contour_control import Params
from servo_ctrl.cyclic.contour_coupling import Coupling
from servo_ctrl.errors import ConfigError


def table(directory: Path, section: str, *changes: tuple[str, str]) -> MachineConfig:
    text = text_of(XY_TABLE / "controller.toml")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (directory / "controller.toml").write_text(f"{text}\n[contour_control]\n{section}\n", encoding="utf-8")
    return load_machine(directory)


def test_it_is_off_without_the_section_and_where_it_is_not_enabled(tmp_path: Path) -> None:
    assert couplings(load_machine(XY_TABLE)) == ()
    assert couplings(table(tmp_path, 'enabled = false\naxes = ["x", "z"]\nkp_1_s = 1e6')) == ()


def test_settings_are_those_of_the_file_in_si_with_the_axes_by_number(tmp_path: Path) -> None:
    machine = table(tmp_path, 'axes = ["y", "x"]\nkp_1_s = 50.0\nlimit_mm_s = 3.0')
    law = Params(kp_1_s=50.0, ki_1_s2=0.0, limit_m_s=0.003, full_speed_m_s=0.001, period_s=0.001)
    assert couplings(machine) == (Coupling(1, 0, law),)


def test_the_largest_gain_that_is_accepted_has_ms_2(tmp_path: Path) -> None:
    machine = load_machine(XY_TABLE)
    below, above = (ContourControl(axes=["x", "y"], kp_1_s=gain) for gain in (55.0, 57.0))
    assert sensitivity_peak_of(machine, below) < 2.0 < sensitivity_peak_of(machine, above)
    table(tmp_path, 'axes = ["x", "y"]\nkp_1_s = 55.0')
    with pytest.raises(ConfigError, match=r"Ms of the two axes is 2\.0\d on their masses, above 2"):
        table(tmp_path, 'axes = ["x", "y"]\nkp_1_s = 57.0')


def test_an_observer_that_may_be_switched_on_counts_and_one_that_the_file_lacks_does_not(
    tmp_path: Path,
) -> None:
    section = 'axes = ["x", "y"]\nkp_1_s = 70.0'
    with pytest.raises(ConfigError, match="Ms of the two axes is 2"):
        table(tmp_path, section)
    without = [
        (f"[axis.{name}.disturbance_observer]\nenabled = false\nbandwidth_hz = 7.5\nmass_kg = {mass_kg}", "")
        for name, mass_kg in (("x", 70.0), ("y", 89.6))
    ]
    assert len(couplings(table(tmp_path, section, *without))) == 1


@pytest.mark.parametrize(
    ("section", "changes", "reason"),
    [
        ('axes = ["x", "y"]\nkp_1_s = 900.0', [], r"control\.kp_1_s: .* the two axes are unstable"),
        ('axes = ["x", "z"]\nkp_1_s = 9.0', [], r"control\.axes: expected two of x, y, not x and z"),
        ('axes = ["x", "x"]\nkp_1_s = 9.0', [], "expected two of x, y, not x and x"),
        ('axes = ["x"]\nkp_1_s = 9.0', [], r"contour_control\.axes: "),
        ('axes = ["x", "y"]\nkp_1_s = -9.0', [], r"contour_control\.kp_1_s: "),
        (
            'axes = ["x", "y"]\nkp_1_s = 9.0',
            [("acceleration_feedforward_kg = 89.6", "")],
            r"axis y needs its mass, control\.acceleration_feedforward_kg",
        ),
        (
            'axes = ["x", "y"]\nkp_1_s = 9.0',
            [("enabled = false                  # instead", "enabled = true  # instead")],
            "axis x has fuzzy_pd, whose gain is not one number",
        ),
        (
            'axes = ["x", "y"]\nkp_1_s = 9.0',
            [
                ('mode = "cst"', 'mode = "csv"'),
                ('"target_torque", "torque_offset"', '"target_velocity"'),
                ("[axis.x.disturbance_observer]\nenabled = false\nbandwidth_hz = 7.5\nmass_kg = 70.0", ""),
                ("[axis.y.disturbance_observer]\nenabled = false\nbandwidth_hz = 7.5\nmass_kg = 89.6", ""),
                ("[axis.x.learned_waveform]\nlimit_n = 170.0", ""),
                ("[axis.y.learned_waveform]\nlimit_n = 230.0", ""),
            ],
            "axis x is in csv, only in cst both of its loops are closed here",
        ),
    ],
)
def test_what_has_no_margin_is_refused_with_its_reason(
    tmp_path: Path, section: str, changes: list[tuple[str, str]], reason: str
) -> None:
    with pytest.raises(ConfigError, match=reason):
        table(tmp_path, section, *changes)
