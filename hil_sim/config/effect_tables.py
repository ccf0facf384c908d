"""Generates the tables of docs/plant.md from the declarations of the effects.

`python -m hil_sim.config.effect_tables docs/plant.md` rewrites the text between its marks; a test compares
the document with `filled`.
"""

import re
import sys
from pathlib import Path
from types import ModuleType

from hil_sim.config.load import SENSORS
from hil_sim.physics.registry import EFFECTS
from kernels.quantities import AXIS, Field, fields_of, section_of

SECTIONS = {section_of(effect): effect for effect in EFFECTS if section_of(effect) not in SENSORS}
"""The effects that are sections of a plant file, by name."""

_MARKED = re.compile(r"(<!-- effect: (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


def filled(document: str) -> str:
    """Return the document with the table of every marked effect rewritten.

    Raises KeyError for a mark of an unknown effect.
    """
    return _MARKED.sub(lambda found: found[1] + described(SECTIONS[found[2]]) + found[3], document)


def described(effect: ModuleType) -> str:
    """Return the first line of an effect's docstring, and a Markdown table of its keys."""
    sentence = (effect.__doc__ or "").partition("\n")[0]
    defaults = effect.Params._field_defaults
    rows = [_row(field, defaults.get(field.name)) for field in fields_of(effect.Params)]
    return "\n".join([sentence, "", "| key | value | meaning |", "|---|---|---|", *rows]) + "\n"


def _row(field: Field, default: float | tuple[float, ...] | None) -> str:
    quantity = field.quantity
    if quantity.file_unit == AXIS:
        return f"| `{field.key}` | name of another axis | {quantity.meaning} |"
    value = default[0] if isinstance(default, tuple) else default
    absent = "" if value is None else f", {quantity.from_si(value):g} where absent"
    lower, upper = (f"{quantity.from_si(bound):.4g}" for bound in (quantity.lower, quantity.upper))
    unit = quantity.file_unit or quantity.unit
    range_of = f"{lower} to {upper} {unit}".rstrip()
    if quantity.length:
        range_of = f"at most {quantity.length} of: {range_of}"
    return f"| `{field.key}` | {range_of} | {quantity.meaning}{absent} |"


def main() -> None:
    """Rewrite the documents named on the command line."""
    for name in sys.argv[1:]:
        path = Path(name)
        path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
