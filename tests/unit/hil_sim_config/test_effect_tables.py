"""The document of the plant's effects is that of the declarations that check the file."""

import re
from pathlib import Path

from hil_sim.config.effect_tables import SECTIONS, described, filled

DOCUMENT = (Path(__file__).parents[3] / "docs" / "plant.md").read_text(encoding="utf-8")


def test_the_tables_are_up_to_date() -> None:
    assert filled(DOCUMENT) == DOCUMENT, "run: python -m hil_sim.config.effect_tables docs/plant.md"


def test_every_effect_has_its_table_under_its_name() -> None:
    marked = re.findall(r"### `(\S+)`\n[^#]*?<!-- effect: (\S+) -->", DOCUMENT)
    assert sorted(name for name, _ in marked) == sorted(SECTIONS)
    assert all(heading == name for heading, name in marked)


def test_a_table_shows_keys_and_bounds_in_the_units_of_the_file() -> None:
    assert "| `level_1_km` | -1000 to 1000 1/km | growth of the friction levels |" in described(
        SECTIONS["friction_ageing"]
    )
    assert "| `share` | at most 8 of: 0 to 1 |" in described(SECTIONS["presliding_gms"])
