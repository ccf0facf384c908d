"""The whole tuning, with the batch twin in the place of the bus: the same law, plant and rounding."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from hil_sim.config import PlantConfig
from servo_ctrl.cli.main import app
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.hmi.tuning.tunings import read_curves, read_figures
from servo_ctrl.recording.reader import Recording
from servo_ctrl.tuning import machine_runs, simulated
from servo_ctrl.tuning.request import STEPS
from twin.plant_file import load_plant
from twin.rollout import rollout

KEPT_RUNS = 2
"""Runs before the machine file is changed: of a tuning that goes well, the measurement."""


class TwinBus:
    """Runs programs as `run_machine` does; each begins at rest where home is."""

    def __init__(self, plant: PlantConfig) -> None:
        self.plant = plant
        self.recordings: dict[Path, Recording] = {}
        self.control: list[Any] = []
        self.required_um: list[float] = []
        """J_required of each run."""
        self.after_run: Callable[[int], None] = lambda _runs: None
        """Called with the number of runs so far at the end of each."""

    async def run_machine(
        self,
        machine: MachineConfig,
        program: ProgramConfig,
        _bus: str,
        *,
        record_dir: Path,
        **_options: object,
    ) -> RunReport:
        self.control.append(machine.axes["x"].control)
        self.required_um.append(machine.monitoring.required_um)
        names = list(machine.axes)
        pieces = list(program_segments(check_program(program, machine), machine, np.zeros(len(names))))
        fields = ("position_m", "velocity_m_s", "acceleration_m_s2", "force_offset_n")
        moving = [np.concatenate([getattr(piece, field) for piece in pieces]) for field in fields]
        reference = {
            name: np.column_stack([values[:, index] for values in moving]) for index, name in enumerate(names)
        }
        params = {name: axis_params(machine, name) for name in names}
        columns = rollout(machine, self.plant, params, reference)
        columns["segment"] = np.concatenate([np.full(len(p.position_m), p.step) for p in pieces])
        header = {"axes": names, "segments": [{"label": step.label} for step in program.steps]}
        self.recordings[record_dir] = Recording(record_dir, header, columns)
        self.after_run(len(self.control))
        return RunReport(
            machine=machine.machine.name,
            completed=True,
            failed=False,
            signal="",
            reason="",
            events=(),
            cycles=len(columns["segment"]),
            missed_ticks=0,
            missing_inputs=0,
            wall_s=1.0,
            spans=(),
            lateness=None,
            recording=record_dir,
            learning=None,  # type: ignore[arg-type]  # not read
            outcomes=(),
        )


@pytest.fixture
def twin_bus(machines: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> TwinBus:
    """An X-Y table whose x axis carries 6 kg that swing at 60 Hz."""
    text = (machines / "xy_table" / "plant.toml").read_text(encoding="utf-8")
    text = text.replace("../../eds", str(machines.parent / "eds"))
    text += "\n[axis.x.structural_mode]\nmass_kg = 6.0\nfrequency_hz = 60.0\ndamping_ratio = 0.02\n"
    (tmp_path / "plant.toml").write_text(text, encoding="utf-8")
    bus = TwinBus(load_plant(tmp_path / "plant.toml"))
    monkeypatch.setattr(machine_runs, "run_machine", bus.run_machine)
    monkeypatch.setattr(machine_runs, "load_recording", bus.recordings.__getitem__)
    monkeypatch.setattr(simulated, "simulated_machine", None)  # no process
    return bus


def test_the_command_measures_proposes_and_proves(machines: Path, twin_bus: TwinBus, tmp_path: Path) -> None:
    arguments = ["tune", "--machine", str(machines / "xy_table"), "--axis", "x", "--bus", "twin:"]
    result = CliRunner().invoke(
        app, [*arguments, "--out", str(tmp_path / "out"), "--pacing", "lockstep", "--progress", "json"]
    )
    assert result.exit_code == 0, result.output
    steps = [json.loads(line) for line in result.stderr.splitlines()]
    assert [step["done"] for step in steps] == list(range(len(steps)))
    assert {(step["format"], step["of"]) for step in steps} == {(1, STEPS)}
    assert len(steps) == STEPS - 1, "a simulator would have been started first"
    figures = json.loads((tmp_path / "out" / "tune.json").read_text(encoding="utf-8"))
    assert figures["proved"]
    assert not figures["simulated"], "a bus was named"
    assert figures["measured_ms"] <= 2.06
    first = figures["resonances"][0]
    # on 69 kg that move freely: 60 Hz (1 + 6 / 69)^(1/2), and as much more damping
    assert abs(first["frequency_hz"] - 62.6) < 0.3
    assert abs(first["damping_ratio"] - 0.0209) < 0.002
    assert abs(figures["plant"]["mass_kg"] - 76.0) < 3.0
    assert abs(figures["held"][0]["frequency_hz"] - 60.0) < 0.3
    assert abs(figures["input_shaper"]["frequency_hz"] - 60.0) < 0.3
    assert figures["after"]["compliance_m_n"] < figures["before"]["compliance_m_n"]
    assert figures["after"]["step_peak_m"] < 0.8 * figures["before"]["step_peak_m"]
    assert twin_bus.control[0].feedback == "motor"  # measured on the motor, proved as the file says
    assert twin_bus.control[-1].feedback == "scale"
    assert {*twin_bus.required_um} == {machine_runs.NEVER_DUE_UM}, "no run says that learning is due"
    told, curves = read_figures(tmp_path / "out"), read_curves(tmp_path / "out")  # as the page reads them
    assert (told.axis, told.proved, told.proposed) == ("x", True, figures["proposed"])
    assert curves is not None
    loops = {one.name: one for one in curves.loop}
    for name, setting in (("before", told.before), ("after", told.after)):
        response = np.array(loops[name].magnitude) * np.exp(1j * np.radians(loops[name].phase_deg))
        peak = float(np.max(1.0 / np.abs(1.0 + response)))
        assert setting.sensitivity_peak == pytest.approx(peak, rel=1e-3)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for part in ("plant-size", "plant-phase", "coherence", "loop-size", "sensitivity", "proof-circle"):
        assert f'id="{part}"' in page
    assert "[axis.x.control]" in (tmp_path / "out" / "tuned.toml").read_text(encoding="utf-8")


def test_what_was_measured_with_one_machine_file_is_not_proved_with_another(
    machines: Path, twin_bus: TwinBus, tmp_path: Path
) -> None:
    file = tmp_path / "controller.toml"
    text = (machines / "xy_table" / "controller.toml").read_text(encoding="utf-8")
    file.write_text(text.replace("../../eds", str(machines.parent / "eds")), encoding="utf-8")

    def change(runs: int) -> None:
        if runs == KEPT_RUNS:
            file.write_text(file.read_text(encoding="utf-8") + "# another one\n", encoding="utf-8")

    twin_bus.after_run = change
    arguments = ["tune", "--machine", str(file), "--axis", "x", "--bus", "twin:", "--pacing", "lockstep"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert "was changed while the axis was tuned" in f"{result.exception} {result.output}"
    assert len(twin_bus.control) == KEPT_RUNS, "nothing moved after the change"
    assert not list((tmp_path / "out").glob("tuned.toml"))
