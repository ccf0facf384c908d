"""The documents' key tables are those of the types that check the files."""

import re
from pathlib import Path

import pytest

from servo_ctrl import config
from servo_ctrl.config.key_tables import SECTIONS, filled, key_table
from servo_ctrl.config.law_sections import SECTION_TYPES
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.node_model import Node
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.config.section import FileSection

DOCS = Path(__file__).parents[3] / "docs"


@pytest.mark.parametrize("name", ["machines.md", "programs.md"])
def test_the_tables_are_up_to_date(name: str) -> None:
    document = (DOCS / name).read_text(encoding="utf-8")
    assert filled(document) == document, f"run: python -m servo_ctrl.config.key_tables docs/{name}"


def test_every_section_has_its_table_in_the_documents() -> None:
    documents = "".join((DOCS / name).read_text(encoding="utf-8") for name in ("machines.md", "programs.md"))
    marked = re.findall(r"<!-- keys: (\S+) -->", documents)
    assert sorted(marked) == sorted(SECTIONS)
    prefix = config.__name__ + "."
    kinds = {kind for base in (FileSection, Node) for kind in base.__subclasses__()} - {Node}
    in_config = {kind for kind in kinds if kind.__module__.startswith(prefix)}
    assert set(SECTIONS.values()) == in_config - {MachineConfig, ProgramConfig} | set(SECTION_TYPES.values())


def test_a_table_shows_range_and_default() -> None:
    table = key_table(SECTIONS["axis.NAME.control"])
    assert "| `velocity_window_samples` | whole number >= 1, <= 2 | `1` |" in table
    assert '| `feedback` | `"scale"`, `"motor"` | `"scale"` |' in table
