"""Report of a part program: limits and speeds before it runs, contour error afterwards."""

from collections.abc import Sequence
from itertools import starmap
from pathlib import Path

import typer

from servo_ctrl.config.dry_run import DryRun
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.part_program import PartProgram, Remark
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.metrology.contour_error import Figures, contour_error, write_contour_error
from servo_ctrl.motion.path.path_move import PathMove
from servo_ctrl.motion.program import Step
from servo_ctrl.recording.reader import load_recording

SLOW_LINES_SHOWN = 5
"""Bounds the program lines that are listed as slow; chosen."""


def print_dry_run(
    program: ProgramConfig, steps: Sequence[Step], machine: MachineConfig, result: DryRun
) -> None:
    """Print the extents and limits of each axis; of a part program its corners, feed and remarks too."""
    typer.echo(
        f"  path of {result.length_m * 1e3:.3f} mm from home, up to {result.path_speed_m_s * 1e3:.6g} mm/s"
    )
    for index, (name, axis) in enumerate(machine.axes.items()):
        lowest, highest = axis.limits.position_mm
        typer.echo(
            f"  {name}: {result.lowest_m[index] * 1e3:.3f} to {result.highest_m[index] * 1e3:.3f} mm "
            f"(limits {lowest:g} to {highest:g}), up to "
            f"{result.speed_m_s[index] * 1e3:.6g} of {axis.limits.velocity_mm_s:g} mm/s, "
            f"{result.acceleration_m_s2[index] * 1e3:.6g} of {axis.limits.acceleration_mm_s2:g} mm/s^2, "
            f"{result.jerk_m_s3[index] * 1e3:.6g} of {axis.limits.jerk_mm_s3:g} mm/s^3"
        )
    if isinstance(program, PartProgram):
        _print_part_program(program, steps, result)


def _print_part_program(program: PartProgram, steps: Sequence[Step], result: DryRun) -> None:
    paths = [step for step in steps if isinstance(step, PathMove)]
    rounded = sorted({path.tolerance_m for path in paths[1:]})
    stops = sum(element.exact_stop for path in paths[1:] for element in path.elements)
    within = ", ".join(f"{tolerance_m * 1e3:g}" for tolerance_m in rounded) or "0"
    offset = ", ".join(f"{axis} {value * 1e3:g}" for axis, value in program.work_offset_m.items())
    typer.echo(
        f"  {program.blocks} blocks, corners within {within} mm, exact stops: {stops}, G54 {offset} mm"
    )
    slowest, slow = result.slowest, result.slow_lines
    if slowest is not None:
        mean, feed = slowest.mean_m_s * 1e3, slowest.feed_m_s * 1e3
        typer.echo(
            f"  the feed is reached on {100.0 * result.reached:.0f} % of the way at feed; "
            f"slowest on line {slowest.line}, {mean:.3g} of {feed:.3g} mm/s on average"
        )
    if slow:
        shown = ", ".join(
            f"line {entry.line} {entry.top_m_s * 1e3:.3g} of {entry.feed_m_s * 1e3:.3g}"
            for entry in slow[:SLOW_LINES_SHOWN]
        )
        more = ", ..." if len(slow) > SLOW_LINES_SHOWN else ""
        typer.echo(f"  never reached in {len(slow)} of {len(result.lines)} pieces (mm/s): {shown}{more}")
    for text in _remarks(program.remarks):
        typer.echo(f"  {text}")


def _remarks(remarks: Sequence[Remark]) -> list[str]:
    """Return one line per kind of remark: the words concerned, and the first program line of each."""
    by_text: dict[str, dict[str, list[int]]] = {}
    for line, word, text in remarks:
        by_text.setdefault(text, {}).setdefault(word, []).append(line)
    return [f"{', '.join(starmap(_places, words.items()))}: {text}" for text, words in by_text.items()]


def _places(word: str, lines: list[int]) -> str:
    times = f" and {len(lines) - 1} more" if len(lines) > 1 else ""
    return f"{word} (line {lines[0]}{times})".lstrip()


def print_contour_error(machine: MachineConfig, program: ProgramConfig | None, directory: Path) -> None:
    """Print the contour error of a recorded part program and write it beside the recording.

    Raises RecordingError.
    """
    if not isinstance(program, PartProgram):
        return
    recording = load_recording(directory)
    found = contour_error(recording, program.motion, machine)
    if found is None:
        return
    write_contour_error(recording, found)
    typer.echo(f"contour error against the program: {_figures(found.to_program)}")
    typer.echo(f"contour error against the commanded path: {_figures(found.to_command)}")
    typer.echo(
        f"corners were rounded by up to {found.rounding.largest_m * 1e6:.2f} um (line {found.rounding.line})"
    )


def _figures(figures: Figures) -> str:
    return (
        f"RMS {figures.rms_m * 1e6:.2f} um, 99 % within {figures.p99_m * 1e6:.2f} um, "
        f"largest {figures.largest_m * 1e6:.2f} um (line {figures.line})"
    )
