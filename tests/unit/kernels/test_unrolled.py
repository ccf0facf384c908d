"""A loop over modules is unrolled in order, and stays a function that compiles."""

from types import ModuleType, SimpleNamespace
from typing import Any

from kernels.unrolled import unrolled


def _module(name: str, **content: Any) -> ModuleType:
    module = ModuleType(f"effects.{name}")
    module.__dict__.update(content)
    return module


def _doubled(p: Any, value: float) -> float:
    return 2.0 * value + float(p.offset)


def _lagged(p: Any, s: Any, value: float) -> float:
    s.memory += p.offset
    return value + float(s.memory)


DOUBLED = _module("doubled", applied=_doubled)
LAGGED = _module("lagged", applied=_lagged, State=object)
BOTH = (DOUBLED, LAGGED)
REVERSED = (LAGGED, DOUBLED)
NONE: tuple[ModuleType, ...] = ()


@unrolled
def in_order(p: Any, s: Any, value: float) -> float:
    """Each in turn."""
    for effect in BOTH:
        if p[effect].enabled:
            value = effect.applied(p[effect], s[effect], value)
    return value


@unrolled
def reversed_order(p: Any, s: Any, value: float) -> float:
    for effect in REVERSED:
        value = effect.applied(p[effect], s[effect], value)
    return value


@unrolled
def over_nothing(value: float) -> float:
    for effect in NONE:
        value = effect.applied(value)
    for _ in range(3):
        value += 1.0
    return value


def _records(enabled: int = 1) -> tuple[Any, Any]:
    p = SimpleNamespace(
        doubled=SimpleNamespace(enabled=enabled, offset=1.0), lagged=SimpleNamespace(enabled=1, offset=10.0)
    )
    return p, SimpleNamespace(lagged=SimpleNamespace(memory=0.0))


def test_modules_are_applied_in_the_order_of_the_tuple() -> None:
    assert in_order(*_records(), 3.0) == (2.0 * 3.0 + 1.0) + 10.0
    assert reversed_order(*_records(), 3.0) == 2.0 * (3.0 + 10.0) + 1.0


def test_what_is_disabled_is_skipped_and_memory_is_changed_in_place() -> None:
    p, s = _records(enabled=0)
    assert in_order(p, s, 3.0) == 13.0
    assert in_order(p, s, 3.0) == 23.0


def test_an_empty_tuple_leaves_nothing_and_other_loops_stay() -> None:
    assert over_nothing(1.0) == 4.0


def test_the_function_keeps_its_file_and_its_text() -> None:
    code = in_order.__code__
    assert code.co_filename == __file__
    assert in_order.__doc__ == "Each in turn."
