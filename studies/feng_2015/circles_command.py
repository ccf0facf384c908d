"""`servo-ctrl experiment circles`: the table's circles against the published errors."""

from pathlib import Path

from servo_ctrl.cli.options import JsonOption, OutOption, TableOption


def circles(
    machine: TableOption = Path("machines/xy_table"),
    out: OutOption = Path("out/circles"),
    json_file: JsonOption = None,
) -> None:
    """Run circles R = 25 mm without compensation and report the errors against Feng et al. 2015, table 3."""
    from studies.feng_2015.circles import run_circles

    run_circles(machine, out, json_file)
