"""docs/security.md names tests that exist, and leaves no claim without one."""

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.page.page_service import PageService
from servo_ctrl.errors import ConfigError

ROOT = Path(__file__).parents[2]
DOCUMENT = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
CLAIMS, TESTS = DOCUMENT.split("## Tests\n")
SAMPLES = """
[[step]]
kind = "samples"
label = "read"
file = "/etc/passwd"
"""


def test_every_claim_has_its_tests_and_every_test_is_there() -> None:
    proofs = dict(re.findall(r"^\| ([A-Z]\d) \| (.*) \|$", TESTS, re.MULTILINE))
    marks = [
        mark for group in re.findall(r"\(([A-Z]\d(?:, [A-Z]\d)*)\)", CLAIMS) for mark in group.split(", ")
    ]
    assert set(marks) == set(proofs)
    for name in (name for proof in proofs.values() for name in re.findall(r"`([^`]+)`", proof)):
        path, _, test = name.partition("::")
        assert f"def {test}" in (ROOT / path).read_text(encoding="utf-8"), name


def test_every_attack_is_defended_with_a_test_or_listed_as_undefended() -> None:
    rows = re.findall(
        r"^\| (?!attack \||-)(.+) \| (.+) \|$",
        CLAIMS.split("## From where")[1].split("## systemd")[0],
        re.MULTILINE,
    )
    assert len(rows) > 30
    for attack, answer in rows:
        proved = re.search(r"\([A-Z]\d(, [A-Z]\d)*\)", answer) is not None
        assert proved != attack.startswith("**"), attack


def test_the_page_begins_with_no_certified_safety_function() -> None:
    assert DOCUMENT.startswith("# Security\n\n**This is not a certified safety function.**")


def test_a_program_of_the_page_cannot_name_files(tmp_path: Path) -> None:
    service = SimpleNamespace(_programs=tmp_path, _config=load_machine(ROOT / "machines" / "xy_table"))
    read = PageService._read_program
    with pytest.raises(ConfigError, match="by `servo-ctrl run --program` only"):
        read(service, "read.toml", SAMPLES + 'position = { x = "a" }\ntime = "t"\n', None)  # type: ignore[arg-type]
