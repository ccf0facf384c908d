"""The form of a program: one card a step, one field a key, with its meaning."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from nicegui import ui

from servo_ctrl.hmi.program_fields import (
    FORMLESS,
    MODELS,
    caption_of,
    fields_of,
    put_value,
    shown_value,
    steps_of,
    text_of,
)

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

    from servo_ctrl.hmi.program_fields import Field


class StepForm:
    """The steps of a program; `changed` is called with the new text."""

    def __init__(self, axes: Sequence[str], changed: Callable[[str], Awaitable[None]]) -> None:
        self._axes, self._changed = axes, changed
        self._steps: list[dict[str, Any]] = []
        self._place = ui.element("div").classes("bench-column").mark("step-form")

    def show(self, text: str) -> bool:
        """Show a program; False where it can only be edited as text."""
        steps = steps_of(text)
        self._place.clear()
        self._steps = steps or []
        with self._place:
            for index, step in enumerate(self._steps):
                self._card(index, step)
            if steps is not None:
                self._adder()
        return steps is not None

    def _card(self, index: int, step: dict[str, Any]) -> None:
        kind, label = step["kind"], step.get("label", step["kind"])
        with ui.expansion(f"{index + 1}  {label}", caption=caption_of(step)).classes("bench-step") as card:
            card.mark(f"step-{index + 1}").props("dense-toggle")
            if kind in FORMLESS:
                ui.label("Columns of a file: edit this step as text.").classes("bench-faint")
            else:
                with ui.element("div").classes("bench-fields"):
                    for field in fields_of(kind, self._axes):
                        self._field(index, step, field)
            with ui.element("div").classes("bench-row"):
                duplicate = ui.button("Duplicate", on_click=partial(self._insert, index + 1, dict(step)))
                duplicate.props("flat")
                ui.button("Delete", on_click=partial(self._delete, index)).props("flat").mark(
                    f"delete-{index + 1}"
                )

    def _field(self, index: int, step: dict[str, Any], field: Field) -> None:
        value = shown_value(step, field)
        mark = f"step-{index + 1}-{field.key}" + (f"-{field.item}" if field.item else "")
        label = field.label + (f" ({field.unit})" if field.unit else "")

        async def put(written: str | None) -> None:
            put_value(step, field, written or "")
            await self._changed(text_of(self._steps))

        if field.options:
            chosen = ui.select(
                [*field.options],
                label=label,
                value=value if value in field.options else None,
                clearable=not field.required,
            )
            chosen.on_value_change(lambda event: put(event.value))
            shown: ui.element = chosen
        else:
            written = ui.input(label, value=value, placeholder=field.default)
            written.on("change", lambda: put(written.value))
            shown = written.props("inputmode=decimal" if field.kind in {"number", "integer"} else "")
        shown.props("outlined dense stack-label").mark(mark).tooltip(field.meaning)

    def _adder(self) -> None:
        with ui.element("div").classes("bench-row"):
            kind = ui.select(
                [kind for kind in MODELS if kind not in FORMLESS], value="move", label="another step"
            )
            kind.props("outlined dense").style("flex: 1 1 120px").mark("new-kind")
            add = ui.button("Add", on_click=lambda: self._insert(len(self._steps), {"kind": kind.value}))
            add.props("outline").mark("add-step")

    async def _insert(self, index: int, step: dict[str, Any]) -> None:
        self._steps.insert(index, step)
        await self._rebuild()

    async def _delete(self, index: int) -> None:
        del self._steps[index]
        await self._rebuild()

    async def _rebuild(self) -> None:
        text = text_of(self._steps)
        self.show(text)
        await self._changed(text)
