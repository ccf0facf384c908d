"""What is mutated, by what, and which tests have to notice."""

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from cosmic_ray.operators.operator import Operator
from cosmic_ray.operators.provider import OperatorProvider

from tests.campaigns.mutation.table_operators import RemoveEntry, ReplaceEnumMember, ReplaceName

REPOSITORY = Path(__file__).parents[3]
LIKELY_SLIPS = {
    *("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Div_FloorDiv", "Mod_Mul"),
    *("BitAnd_BitOr", "BitOr_BitAnd", "BitOr_BitXor", "LShift_RShift"),
}
"""Of Cosmic Ray's eleven replacements of each arithmetic operator. The others (a mask that is divided, a sum
that is shifted) are nobody's slip, and as many again; they are left out to keep it to minutes."""
NEVER_MEANT = {"VariableReplacer", "VariableInserter"}
"""Operators for experiments with a named variable."""
BINARY = "ReplaceBinaryOperator_"


class Target(NamedTuple):
    """A file, and the tests that are about it, the quick ones first."""

    file: str
    tests: tuple[str, ...]
    """Test files that say how it should behave."""
    documents: tuple[str, ...] = ()
    """Tests that compare a page with the table: run last, for they check only a copy."""
    groups: tuple[tuple[str, ...], ...] = ()
    """Names that stand for one another in the tables."""


DRIVE_WORDS = ("SHUTDOWN", "SWITCH_ON", "ENABLE_OPERATION", "DISABLE_VOLTAGE", "QUICK_STOP", "FAULT_RESET")
TARGETS = (
    Target("servo_ctrl/control/limits.py", ("tests/unit/servo_control/test_limits.py",)),
    Target("hil_sim/drive/travel_limits.py", ("tests/unit/hil_sim_drive/test_travel_limits.py",)),
    Target(
        "servo_ctrl/cyclic/cia402.py",
        ("tests/unit/servo_canopen/test_cia402_values.py", "tests/unit/servo_canopen/test_cia402_tables.py"),
        groups=(DRIVE_WORDS,),
    ),
    Target("servo_ctrl/motion/violation.py", ("tests/unit/servo_motion/test_violation.py",)),
    Target(
        "servo_ctrl/axis/fault_policy.py",
        ("tests/unit/servo_axis/test_fault_policy_rules.py", "tests/unit/servo_axis/test_fault_policy.py"),
        ("tests/unit/servo_axis/test_fault_policy.py::test_document_shows_the_table",),
        (("_NONE", "_HOLD", "_QUICK", "_CUT", "_OFF"),),
    ),
    Target(
        "servo_ctrl/axis/fault_bounds.py",
        ("tests/unit/servo_axis/test_fault_bounds.py",),
        groups=(("_READ", "_HEARD"),),
    ),
    Target(
        "servo_ctrl/cyclic/supervision.py",
        ("tests/unit/servo_axis/test_supervision.py", "tests/unit/servo_axis/test_supervision_edges.py"),
        groups=(("NOTHING", "SATURATED", "RUNAWAY"),),
    ),
    Target(
        "servo_ctrl/axis/supervision.py",
        ("tests/unit/servo_axis/test_supervision_limits.py",),
        groups=(("PUSH_SHARE", "ERROR_SHARE", "LIMIT_SHARE"),),
    ),
    Target("servo_ctrl/cyclic/sequence.py", ("tests/unit/servo_axis/test_drive_sequence.py",)),
    Target("servo_ctrl/daemon/cycle/missed_ticks.py", ("tests/unit/servo_daemon/test_missed_ticks.py",)),
    Target("servo_ctrl/daemon/cycle/missing_inputs.py", ("tests/unit/servo_daemon/test_missing_inputs.py",)),
    Target(
        "hil_sim/drive/cia402_device.py",
        ("tests/unit/hil_sim_drive/test_cia402_table.py",),
        ("tests/docs/test_drive_states_diagram.py",),
    ),
)


class Mutant(NamedTuple):
    """One change of one file."""

    file: str
    operator: str
    occurrence: int
    source: str
    """The file as it would be."""


def operators_of(target: Target, source: str) -> Iterator[tuple[str, Operator]]:
    """Cosmic Ray's, and ours for tables."""
    provided: Any = OperatorProvider()
    for name in sorted(provided):
        unlikely = name.startswith(BINARY) and name.removeprefix(BINARY) not in LIKELY_SLIPS
        if name not in NEVER_MEANT and not unlikely:
            yield name, provided[name]()
    yield "RemoveEntry", RemoveEntry()
    if members := enum_members(source):
        yield "ReplaceEnumMember", ReplaceEnumMember(members)
    if target.groups:
        yield "ReplaceName", ReplaceName(target.groups)


def enum_members(source: str) -> dict[str, Sequence[str]]:
    """Enums that a file defines, with their members in order."""
    found: dict[str, Sequence[str]] = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef) and any("Enum" in ast.unparse(base) for base in node.bases):
            assigned = [item for item in node.body if isinstance(item, ast.Assign)]
            found[node.name] = [
                name.id for item in assigned for name in item.targets if isinstance(name, ast.Name)
            ]
    return found
