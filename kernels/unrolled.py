"""Unrolls loops over modules before compilation.

Numba compiles no loop over modules, because each module has functions and records of its own types. So the
loop is unrolled in the source: a function with

    for effect in EFFECTS:
        if p[effect].enabled:
            force += effect.force_n(p[effect], s[effect], position_m)

becomes, for each module of the tuple EFFECTS in turn,

        if p.cogging.enabled:
            force += cogging.force_n(p.cogging, position_m)

`p[effect]` becomes the field with the name of the module's file. So does `s[effect]`, but calls omit this
argument for a module without `State`. The order of the tuple is the order of the arithmetic.
"""

import ast
import copy
import inspect
import textwrap
from collections.abc import Callable
from types import ModuleType
from typing import Any, TypeVar, cast

from kernels.quantities import section_of

F = TypeVar("F", bound="Callable[..., Any]")


STATE = "s"
"""The name of the state record, of which only modules with `State` have a part."""


def unrolled(function: F) -> F:
    """Return `function` with every loop over a global tuple of modules unrolled; line numbers are kept.

    The modules must be global, so that the compiler finds them; apply `kernel` outside this decorator.
    """
    lines, first = inspect.getsourcelines(function)
    tree = ast.parse(textwrap.dedent("".join(lines)))
    ast.increment_lineno(tree, first - 1)
    definition = next(node for node in tree.body if isinstance(node, ast.FunctionDef))
    definition.decorator_list = []
    names = function.__globals__
    names.update(_unroll(definition, names))
    made: dict[str, Any] = {}
    code = compile(ast.fix_missing_locations(tree), function.__code__.co_filename, "exec")
    exec(code, names, made)  # noqa: S102  # the function's own source
    return cast("F", made[function.__name__])


def _unroll(definition: ast.FunctionDef, names: dict[str, Any]) -> dict[str, ModuleType]:
    """Unroll the loops of a definition in place; return the modules by their names in it."""
    modules: dict[str, ModuleType] = {}

    class Loops(ast.NodeTransformer):
        def visit_For(self, loop: ast.For) -> Any:  # ast's name
            over = names.get(loop.iter.id) if isinstance(loop.iter, ast.Name) else None
            if not (isinstance(over, tuple) and isinstance(loop.target, ast.Name)):
                return self.generic_visit(loop)
            body: list[ast.stmt] = []
            for module in over:
                name = f"_{section_of(module)}"
                modules[name] = module
                one = _OneModule(loop.target.id, name, module)
                body += [one.visit(copy.deepcopy(statement)) for statement in loop.body]
            return body or ast.Pass()

    Loops().visit(definition)
    return modules


class _OneModule(ast.NodeTransformer):
    """Replaces the loop variable by one module."""

    def __init__(self, variable: str, name: str, module: ModuleType) -> None:
        self._variable, self._name = variable, name
        self._section, self._has_state = section_of(module), hasattr(module, "State")

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:  # ast's name
        """Replace `p[effect]` by a field of the record."""
        self.generic_visit(node)
        if isinstance(node.slice, ast.Name) and node.slice.id == self._name:
            return ast.Attribute(node.value, self._section, node.ctx)
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:  # ast's name
        """Remove the state argument for a module without `State`."""
        if not self._has_state:
            node.args = [argument for argument in node.args if not self._is_state(argument)]
        return self.generic_visit(node)  # type: ignore[return-value]  # ast.NodeTransformer.generic_visit

    def _is_state(self, node: ast.expr) -> bool:
        return (
            isinstance(node, ast.Subscript)
            and isinstance(node.value, ast.Name)
            and node.value.id == STATE
            and isinstance(node.slice, ast.Name)
            and node.slice.id == self._variable
        )

    def visit_Name(self, node: ast.Name) -> ast.Name:  # ast's name
        """Replace the loop variable by the module."""
        return ast.Name(self._name, node.ctx) if node.id == self._variable else node
