"""HTML from Jinja2 templates that lie beside the package that fills them. Only this file uses Jinja2.

Every value is escaped; what is HTML already is passed as `Markup`.
"""

from importlib.resources import files

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

__all__ = ["Markup", "filled"]

_ENVIRONMENT = Environment(
    autoescape=True, undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True
)


def filled(room: str, template: str, **values: object) -> str:
    """Return the template of the package `room` with its values."""
    text = files(room).joinpath(template).read_text(encoding="utf-8")
    return _ENVIRONMENT.from_string(text).render(values)
