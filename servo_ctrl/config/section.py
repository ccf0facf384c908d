"""The base of the types of all file tables."""

import ast
import inspect
import textwrap
from itertools import pairwise
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler, Strict

Number = Annotated[float, Strict()]
Positive = Annotated[float, Strict(), Field(gt=0.0)]
NonNegative = Annotated[float, Strict(), Field(ge=0.0)]


class FileSection(BaseModel):
    """A table of a file: immutable, without unknown keys and infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Describe the keys by the docstrings below them, read only where a form or a document asks.

        Pydantic's `use_attribute_docstrings` reads and parses the source of each section whenever it is
        imported: a sixth of the processor time that a controller takes to start.
        """
        schema = handler(core_schema)
        properties = handler.resolve_ref_schema(schema).get("properties", {})
        for key, meaning in _meanings_of_keys(cls).items():
            if key in properties:
                properties[key].setdefault("description", meaning)
        return schema


def _meanings_of_keys(section: type[FileSection]) -> dict[str, str]:
    """Return the docstring below each key of a section and of its bases; the most derived class wins."""
    meanings: dict[str, str] = {}
    for base in reversed(section.__mro__):
        if not issubclass(base, FileSection) or base is FileSection:
            continue
        if base.__pydantic_generic_metadata__["origin"] is not None:
            continue  # a parametrized generic section shares the source of its generic base, which follows
        tree = ast.parse(textwrap.dedent(inspect.getsource(base)))
        body = next(node.body for node in tree.body if isinstance(node, ast.ClassDef))
        for key, statement in pairwise(body):
            if isinstance(key, ast.AnnAssign) and isinstance(key.target, ast.Name):
                match statement:
                    case ast.Expr(value=ast.Constant(value=str(meaning))):
                        meanings[key.target.id] = inspect.cleandoc(meaning)
    return meanings
