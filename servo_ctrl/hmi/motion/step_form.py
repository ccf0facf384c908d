"""The form of a program: a card for each step, a field for each key with its meaning as a tooltip."""

from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Any

from nicegui import ui

from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.motion.step_fields import (
    MODELS,
    WITHOUT_FORM,
    StepField,
    caption_of,
    fields_of,
    put_value,
    shown_value,
    steps_of,
    text_of,
)
from servo_ctrl.hmi.shell.parts import add_tooltip, button, div, faint


class StepForm:
    """The steps of a program; `on_change` is called with the new text."""

    def __init__(self, axes: Sequence[str], on_change: Callable[[str], Awaitable[None]]) -> None:
        self._axes, self._on_change = axes, on_change
        self._steps: list[dict[str, Any]] = []
        self._place = div("bench-column").mark("step-form")

    def show(self, text: str) -> bool:
        """Show a program; return False where it can be edited as text only."""
        steps = steps_of(text)
        self._place.clear()
        self._steps = steps or []
        with self._place:
            for index, step in enumerate(self._steps):
                self._step_card(index, step)
            if steps is not None:
                self._adder()
        return steps is not None

    def _step_card(self, index: int, step: dict[str, Any]) -> None:
        kind, label, number = step["kind"], step.get("label", step["kind"]), index + 1
        with ui.expansion(f"{number}  {label}", caption=caption_of(step)).classes("bench-step") as card:
            card.mark(f"step-{number}").props("dense-toggle")
            if kind in WITHOUT_FORM:
                faint(tr("Columns of a file: edit this step as text."))
            else:
                with div("bench-fields"):
                    for field in fields_of(kind, self._axes):
                        self._field(f"step-{number}-{field.key}", step, field)
            with div("bench-row"):
                duplicate = partial(self._insert, number, dict(step))
                button(tr("Duplicate"), duplicate, f"duplicate-{number}", look="flat")
                button(tr("Delete"), partial(self._delete, index), f"delete-{number}", look="flat")

    def _field(self, mark: str, step: dict[str, Any], field: StepField) -> None:
        value = shown_value(step, field)
        label = tr(field.name) + (f" {field.axis}" if field.axis else "")
        label += f" ({field.unit})" if field.unit else ""

        async def put(written: str | None) -> None:
            put_value(step, field, written or "")
            await self._on_change(text_of(self._steps))

        shown: ui.element
        if field.options:
            chosen = value if value in field.options else None
            shown = ui.select([*field.options], label=label, value=chosen, clearable=not field.required)
            shown.on_value_change(lambda event: put(event.value))
        else:
            typed = ui.input(label, value=value, placeholder=field.default)
            typed.on("change", lambda: put(typed.value))
            shown = typed.props("inputmode=decimal" if field.kind in {"number", "integer"} else "")
        mark += f"-{field.axis}" if field.axis else ""
        add_tooltip(shown.props("stack-label").mark(mark), tr(field.meaning))

    def _adder(self) -> None:
        with div("bench-row"):
            kinds = [kind for kind in MODELS if kind not in WITHOUT_FORM]
            kind = ui.select(kinds, value="move", label=tr("another step"))
            kind.style("flex: 1 1 120px").mark("new-kind")
            button(tr("Add"), lambda: self._insert(len(self._steps), {"kind": kind.value}), "add-step")

    async def _insert(self, index: int, step: dict[str, Any]) -> None:
        self._steps.insert(index, step)
        await self._rebuild()

    async def _delete(self, index: int) -> None:
        del self._steps[index]
        await self._rebuild()

    async def _rebuild(self) -> None:
        text = text_of(self._steps)
        self.show(text)
        await self._on_change(text)
