"""Findings of the suite, one verdict per clause, as text, JUnit XML and HTML."""

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple
from xml.etree import ElementTree as ET

from servo_ctrl.files.html_template import filled


class Verdict(StrEnum):
    """Verdict on one clause."""

    PASS = "pass"  # noqa: S105  # no password
    FAIL = "fail"
    NOT_APPLICABLE = "not applicable"


class ClauseFinding(NamedTuple):
    """One clause of a standard, and whether the node meets it; `reason` is empty if it does."""

    clause: str
    title: str
    verdict: Verdict
    reason: str


def failures(findings: Sequence[ClauseFinding]) -> list[ClauseFinding]:
    """Return the clauses that the node does not meet."""
    return [finding for finding in findings if finding.verdict is Verdict.FAIL]


def count(findings: Sequence[ClauseFinding]) -> str:
    """Summary line: how many of each verdict."""
    number = {verdict: sum(f.verdict is verdict for f in findings) for verdict in Verdict}
    return ", ".join(f"{number[verdict]} {verdict}" for verdict in Verdict)


def line(finding: ClauseFinding) -> str:
    """Line for the terminal."""
    reason = f": {finding.reason}" if finding.reason else ""
    return f"{finding.verdict:14s}  {finding.clause}  {finding.title}{reason}"


def junit(findings: Sequence[ClauseFinding], title: str) -> str:
    """Format the findings as JUnit XML for build servers."""
    number = {verdict: str(sum(f.verdict is verdict for f in findings)) for verdict in Verdict}
    suite = ET.Element(
        "testsuite",
        name=title,
        tests=str(len(findings)),
        failures=number[Verdict.FAIL],
        skipped=number[Verdict.NOT_APPLICABLE],
        errors="0",
    )
    for finding in findings:
        case = ET.SubElement(suite, "testcase", classname=finding.clause, name=finding.title)
        if finding.verdict is Verdict.FAIL:
            ET.SubElement(case, "failure", message=finding.reason)
        elif finding.verdict is Verdict.NOT_APPLICABLE:
            ET.SubElement(case, "skipped", message=finding.reason)
    ET.indent(suite)
    return ET.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


def page(findings: Sequence[ClauseFinding], title: str) -> str:
    """Format the findings as a self-contained HTML page."""
    return filled(
        "servo_ctrl.conformance", "page.html.j2", title=title, count=count(findings), findings=findings
    )
