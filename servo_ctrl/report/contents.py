"""Assembles all sections of a report in order."""

from servo_ctrl.report.axis_section import axis_sections
from servo_ctrl.report.circle_section import circle_section
from servo_ctrl.report.content import Report
from servo_ctrl.report.positioning_section import positioning_section
from servo_ctrl.report.recorded_run import RecordedRun
from servo_ctrl.report.reversal_section import reversal_section
from servo_ctrl.report.run_section import contour_section, run_sections, verdict


def report_of(run: RecordedRun) -> Report:
    """Evaluate a recorded run into a report."""
    word, good, sentence = verdict(run.header)
    overview, *by_axis = axis_sections(run)
    special = (circle_section(run), positioning_section(run), contour_section(run))
    first, events, setup = run_sections(run)
    sections = [first, events, overview, *(one for one in special if one), reversal_section(run)]
    program = (run.header.program or "no program").rpartition("/")[2]
    return Report(
        title=f"{run.header.machine}: {program}, {run.header.started[:16].replace('T', ' ')} UTC",
        verdict=word,
        good=good,
        sentence=sentence,
        sections=(*sections, *by_axis, setup),
    )
