"""Draws circles without and with contour control: `python -m studies.koren_1991.contour_picture FILE`."""

import argparse
from pathlib import Path

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.plots.figures import plot_contour
from studies.feng_2015.twin_motions import twin_program
from studies.koren_1991.contour_motions import RADIUS_MM, circle_traces, circles_of, coupled
from studies.koren_1991.contour_study import MACHINE
from twin.plant_file import load_plant


def main() -> None:
    """Run the fastest circle twice in the batch twin and draw its deviation, magnified."""
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=Path)
    path = parser.parse_args().file
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    circles = twin_program(machine, circles_of(machine))
    params = {name: axis_params(machine, name) for name in machine.axes}
    traces = [
        circle_traces(own, plant, circles, params)[-1]._replace(label=label)
        for label, own in (("each axis by itself", machine), ("coupled", coupled(machine)))
    ]
    plot_contour(path, traces, RADIUS_MM * 1e-3)


if __name__ == "__main__":
    main()
