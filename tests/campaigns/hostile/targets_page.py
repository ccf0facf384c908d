"""Fuzz targets: files and inputs of the page."""

import json
from collections.abc import Sequence

from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.hmi.bus.object_tree import INTEGERS, REALS, TEXTS, ObjectEntry, load_entries
from servo_ctrl.hmi.bus.object_values import parse_value, request_value, value_text
from servo_ctrl.hmi.diagnosis.verdict import VerdictError, improvements, parameter_text, percent, read_verdict
from servo_ctrl.hmi.motion.step_fields import fields_of, put_value, shown_value, steps_of, text_of
from tests.campaigns.hostile.targets import GOLDEN, file_with, target
from tests.campaigns.hostile.targets_eds import EDS_WORDS, SMALL_EDS
from tests.campaigns.hostile.targets_files import TABLE, of

TYPES = (*INTEGERS, *REALS, *TEXTS, 0xA, 0xC, 0xF, 0x99)


@target("servo_ctrl.hmi.bus.object_tree", lambda: [SMALL_EDS], declared=EdsError, words=EDS_WORDS, short=100)
def eds_at_the_page(data: bytes) -> None:
    for entry in load_entries(file_with(data, "page.eds"), 1):
        assert entry.address
        assert entry.type_name
        value_text(entry, entry.default)


def _typed() -> Sequence[bytes]:
    typed = {0x4: b"-42", 0x7: b"0x2A", 0x8: b"0.25", 0x9: b"drive", 0xA: b"01 A0 FF", 0x10: b"0Ah"}
    return [bytes((TYPES.index(code),)) + text for code, text in typed.items()]


@target("servo_ctrl.hmi.bus.object_values", _typed, declared=ValueError, words=(b"1e39", b"2Ah", b"nan"))
def typed_value(data: bytes) -> None:
    """Convert an input to an object's value: JSON, and within the range of its type."""
    code, text = TYPES[(data[:1] or b"\0")[0] % len(TYPES)], data[1:].decode("utf-8", "replace")
    entry = ObjectEntry(0x2000, 0, "object", code, "rw")
    value_text(entry, text)
    value = parse_value(entry, text)
    json.dumps(request_value(entry, value), allow_nan=False)
    value_text(entry, value)


@target(
    "servo_ctrl.hmi.diagnosis.verdict",
    of(GOLDEN / "diagnosis" / "verdict.json"),
    declared=VerdictError,
    words=(b"NaN", b"1e308", b"1e-320", b"null", b"[]"),
    short=150,
)
def verdict_at_the_page(data: bytes) -> None:
    verdict = read_verdict(file_with(data, "verdict.json"))
    for better in improvements(verdict):
        assert better.unit
    for finding in verdict.findings:
        percent(finding.confidence)
        assert all(parameter_text(parameter) for parameter in finding.parameters.values())


@target("servo_ctrl.hmi.motion.step_fields", of(TABLE / "programs" / "circles.toml"), short=150)
def program_at_the_page(data: bytes) -> None:
    """Read a program into the form, change a number in each field, and write it again."""
    steps = steps_of(data.decode("utf-8", "replace"))
    for step in steps or ():
        for field in fields_of(step["kind"], ("x", "y")):
            shown_value(step, field)
            put_value(step, field, "7,5")
    if steps:
        assert _as_json(steps_of(text_of(steps))) == _as_json(steps)


def _as_json(steps: object) -> str:
    return json.dumps(steps, sort_keys=True, default=str)  # in which NaN is NaN
