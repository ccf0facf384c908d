"""Channels that a visitor computes from others, as `abs(x.position_error_m) * 1e6 [µm]`.

The expression is read by Python's own parser and evaluated node by node: numbers, channels, + - * / **, and a
few functions. Nothing else is evaluated, so that nothing else can be asked for.
"""

import ast
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.languages.texts import tr

MAX_CHARACTERS, MAX_NODES = 200, 60
"""Bound what is parsed and what is computed for every picture; chosen."""
_UNIT = re.compile(r"\s*\[(?P<unit>[^\[\]]{0,12})\]\s*$")
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.USub: operator.neg, ast.UAdd: operator.pos}
_FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "abs": (1, np.abs),
    "sqrt": (1, np.sqrt),
    "sin": (1, np.sin),
    "cos": (1, np.cos),
    "min": (2, np.minimum),
    "max": (2, np.maximum),
}
"""By name: arguments and function; `d`, the derivative by time, needs the row before and is apart."""
DERIVATIVE = "d"
FUNCTIONS = (*_FUNCTIONS, DERIVATIVE)


class ExpressionError(ServoCtrlError):
    """An expression cannot be used; the text says why."""


class MathChannel(NamedTuple):
    """An expression that was checked."""

    expression: str
    unit: str
    """The unit in brackets behind it, "" without one."""
    tree: ast.expr

    def values(self, rows: Array, places: Mapping[str, int], period_s: float) -> Array:
        """Return the values (n - 1,), SI, of rows (n, channels); the first row is the one before."""
        with np.errstate(all="ignore"):
            found = np.asarray(_evaluated(self.tree, rows, places, period_s), dtype=np.float64)
        whole = np.broadcast_to(found, (len(rows),))[1:]
        return np.where(np.isfinite(whole), whole, np.nan)


def math_channel(text: str, names: Mapping[str, int]) -> MathChannel:
    """Read an expression over the channels `names`. Raises ExpressionError."""
    if len(text) > MAX_CHARACTERS:
        raise ExpressionError(tr("an expression has {most} characters at most", most=MAX_CHARACTERS))
    unit = _UNIT.search(text)
    expression = _UNIT.sub("", text).strip()
    try:
        tree = ast.parse(expression, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionError(tr('"{text}" is not an expression', text=expression)) from None
    if sum(1 for _ in ast.walk(tree)) > MAX_NODES:
        raise ExpressionError(tr("the expression is too long"))
    _check(tree, names)
    return MathChannel(text.strip(), unit["unit"].strip() if unit else "", tree)


def _check(node: ast.expr, names: Mapping[str, int]) -> None:
    """Refuse what is neither number, channel, operation nor function. Raises ExpressionError."""
    match node:
        case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
            return
        case ast.Name() | ast.Attribute():
            if _name(node) not in names:
                raise ExpressionError(tr("there is no channel {name}", name=_name(node)))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            _check(left, names)
            _check(right, names)
        case ast.UnaryOp(op=sign, operand=operand) if type(sign) in _UNARY:
            _check(operand, names)
        case ast.Call(func=ast.Name(id=function), args=arguments, keywords=[]) if function in FUNCTIONS:
            wanted = 1 if function == DERIVATIVE else _FUNCTIONS[function][0]
            if len(arguments) != wanted:
                text = tr("{function} takes {count} values", function=function, count=wanted)
                raise ExpressionError(text)
            for argument in arguments:
                _check(argument, names)
        case _:
            allowed = ", ".join(FUNCTIONS)
            text = tr("numbers, channels, + - * / ** and {functions} are allowed", functions=allowed)
            raise ExpressionError(text)


def _name(node: ast.expr) -> str:
    """Return a channel's name; "" for any other expression."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=ast.Name(id=axis), attr=channel):
            return f"{axis}.{channel}"
    return ""


def _evaluated(node: ast.expr, rows: Array, places: Mapping[str, int], period_s: float) -> Any:
    def value(inner: ast.expr) -> Any:
        return _evaluated(inner, rows, places, period_s)

    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.BinOp(left=left, op=op, right=right):
            return _BINARY[type(op)](value(left), value(right))
        case ast.UnaryOp(op=sign, operand=operand):
            return _UNARY[type(sign)](value(operand))
        case ast.Call(func=ast.Name(id=function), args=arguments):
            if function == DERIVATIVE:
                whole = np.broadcast_to(value(arguments[0]), (len(rows),))
                return np.diff(whole, prepend=np.nan) / period_s
            return _FUNCTIONS[function][1](*map(value, arguments))
    return rows[:, places[_name(node)]]
