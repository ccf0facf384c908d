"""Contour control on the X-Y table, measured: `python -m studies.koren_1991.contour_study --json FILE`.

Every machine is measured without and with the coupling, all in the batch twin: as it is, with gains that
differ between the axes, without velocity feedforward as in the paper, under the conditions of the waveform
study, with learned waveforms, and on random tables, without play and with it. The gain is the same
everywhere; where a machine file with it would be refused, that is told. The rival is simpler: each axis by
itself, with kp + kp_c, which has the same Ms.
"""

import argparse
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.config.contour import SENSITIVITY_PEAK_MAX, sensitivity_peak_of
from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from studies.feng_2015.waveform_conditions import (
    BACKLASH_GAP_M,
    Condition,
    named_conditions,
    random_tables,
    with_backlash,
)
from studies.feng_2015.waveform_learning import with_learned
from studies.feng_2015.waveform_robustness import learned_of
from studies.koren_1991.contour_motions import GAIN_1_S, contour_errors, coupled, motions_of
from twin.plant_file import load_plant

MACHINE = Path(__file__).parents[2] / "machines" / "xy_table"
SEED = 1991
"""Seed of the random tables; chosen."""
LOWER_GAIN_RATIO = 0.8
"""Factor of a gain of y where the gains differ; from the task."""
FOLLOWING_ERROR_MM = 10.0
"""Limit of the following error where no feedforward takes the lag away; chosen."""


def machines(machine: MachineConfig) -> Iterator[tuple[str, MachineConfig]]:
    """Yield the machine with gains that differ, and without velocity feedforward, as in the paper."""
    y = machine.axes["y"].control
    yield "kp of y -20 %", with_control(machine, "y", kp_1_s=LOWER_GAIN_RATIO * y.kp_1_s)
    yield (
        "kv and ki of y -20 %",
        with_control(
            machine, "y", kv_n_s_m=LOWER_GAIN_RATIO * y.kv_n_s_m, ki_n_m=LOWER_GAIN_RATIO * y.ki_n_m
        ),
    )
    lagging = machine
    for name in machine.axes:
        limits = machine.axes[name].limits.model_copy(update={"following_error_mm": FOLLOWING_ERROR_MM})
        lagging = with_control(lagging, name, velocity_feedforward=0.0)
        axes = lagging.axes | {name: lagging.axes[name].model_copy(update={"limits": limits})}
        lagging = lagging.model_copy(update={"axes": axes})
    yield "no velocity feedforward", lagging
    yield (
        "no velocity feedforward, kp of y -20 %",
        with_control(lagging, "y", kp_1_s=LOWER_GAIN_RATIO * y.kp_1_s),
    )


def with_control(machine: MachineConfig, axis: str, **changes: float) -> MachineConfig:
    """Return the machine with other gains of an axis."""
    control = machine.axes[axis].control.model_copy(update=changes)
    axes = machine.axes | {axis: machine.axes[axis].model_copy(update={"control": control})}
    return machine.model_copy(update={"axes": axes})


def with_more_gain(params: AxisParams) -> AxisParams:
    """Return the parameters with the gain of the coupling in the axis's own position loop."""
    position = params.position_loop
    return params._replace(position_loop=position._replace(kp_1_s=position.kp_1_s + GAIN_1_S))


def measured(condition: Condition, *, waveforms: bool = False) -> dict[str, Any]:
    """Return name, Ms and errors of a machine without, with the coupling and with its rival, for JSON."""
    machine, plant = condition.machine, condition.plant
    section = ContourControl(axes=list(machine.axes), kp_1_s=GAIN_1_S)
    peak = sensitivity_peak_of(machine, section)
    entry: dict[str, Any] = {"name": condition.name, "Ms": peak, "refused": peak > SENSITIVITY_PEAK_MAX}
    if entry["refused"]:
        return {**entry, "motions": []}
    params = {name: axis_params(machine, name) for name in machine.axes}
    if waveforms:
        learned = learned_of(condition)
        params = {name: with_learned(own, learned[name]) for name, own in params.items()}
    motions = motions_of(machine)
    without = contour_errors(machine, plant, motions, params)
    with_coupling = contour_errors(coupled(machine), plant, motions, params)
    stiffer = contour_errors(
        machine, plant, motions, {name: with_more_gain(own) for name, own in params.items()}
    )
    rows = [
        {
            "label": label,
            "without": own._asdict(),
            "coupled": with_coupling[label]._asdict(),
            "stiffer": stiffer[label]._asdict(),
        }
        for label, own in without.items()
    ]
    return {**entry, "motions": rows}


def main() -> None:
    """Measure every machine; write JSON after each."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tables", type=int, default=20)
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    as_it_is, *others = named_conditions(machine, plant)
    own_gains = [Condition(name, changed, plant) for name, changed in machines(machine)]
    figures: dict[str, Any] = {"made": "batch twin", "gain_1_s": GAIN_1_S, "seed": SEED}
    figures |= {"machines": [], "tables": [], "tables_with_play": []}
    for condition in chain([as_it_is], own_gains, others):
        figures["machines"].append(measured(condition))
        write_figures(options.json, figures)
    learned = as_it_is._replace(name="learned waveforms (LWC)")
    figures["machines"].append(measured(learned, waveforms=True))
    for condition in random_tables(machine, plant, options.tables, SEED):
        worn = condition._replace(plant=with_backlash(condition.plant, BACKLASH_GAP_M))
        figures["tables"].append(measured(condition))
        figures["tables_with_play"].append(measured(worn))
        write_figures(options.json, figures)


if __name__ == "__main__":
    main()
