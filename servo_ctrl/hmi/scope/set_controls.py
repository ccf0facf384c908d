"""The fields for channel sets and for computed channels."""

import asyncio
from collections.abc import Callable
from functools import partial

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.scope.channel_sets import ChannelSet, change_set, load_sets
from servo_ctrl.hmi.scope.controls import ScopeChoices
from servo_ctrl.hmi.scope.math_channels import FUNCTIONS, math_channel
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, choice, div, errors_notified, faint, notify
from servo_ctrl.hmi.shell.units import UNIT_SYSTEMS

MAX_EXPRESSIONS = 4
"""Bounds the computed channels of one scope; chosen: each is computed for every frame."""


class SetFields:
    """A list of the sets that are kept, and a name for the one that is seen; `on_load` shows another."""

    def __init__(
        self,
        page: OpenPage,
        choices: ScopeChoices,
        on_load: Callable[[ScopeChoices, str], None],
        shown: str = "",
    ) -> None:
        """`shown`: the name of the set that the choices are of; "" for none."""
        self._page, self._choices, self._on_load, self._shown = page, choices, on_load, shown
        self._sets: dict[str, ChannelSet] = {}
        with div("bench-row"):
            self._kept = choice([], tr("channel set"), "scope-set", "width: 200px", on_change=self._load)
            self._name = ui.input(tr("keep as"), value=shown).mark("scope-set-name").style("width: 180px")
            button(tr("Keep set"), self._keep, "scope-set-keep", icon="bookmark_add", look="flat")
            button(tr("Delete set"), self._delete, "scope-set-delete", look="flat")
        ui.timer(0.0, self._read, once=True)

    async def _read(self) -> None:
        with errors_notified("warning"):
            self._show(await asyncio.to_thread(load_sets, self._page.services.recordings))

    def _show(self, sets: dict[str, ChannelSet]) -> None:
        self._sets = sets
        self._kept.set_options(list(sets), value=self._shown if self._shown in sets else None)

    def _load(self) -> None:
        name = str(self._kept.value or "")
        chosen = self._sets.get(name)
        if chosen is not None and name != self._shown:
            self._on_load(choices_of(chosen, self._page.units.name), name)

    async def _keep(self) -> None:
        await self._change(str(self._name.value or ""), set_of(self._choices, self._page.units.name))

    async def _delete(self) -> None:
        await self._change(str(self._kept.value or self._name.value or ""), None)

    async def _change(self, name: str, wanted: ChannelSet | None) -> None:
        if not self._page.permits(Role.OPERATE):  # it writes on the controller's disk
            return
        with errors_notified("warning"):
            self._show(await asyncio.to_thread(change_set, self._page.services.recordings, name, wanted))
            text = tr("Set {name} is kept.", name=name) if wanted else tr("Set {name} is deleted.", name=name)
            notify(text, "positive")


def set_of(choices: ScopeChoices, units: str) -> ChannelSet:
    """Return what is kept of the choices; cursors are not."""
    fields = {name: getattr(choices, name) for name in ChannelSet.model_fields if name != "units"}
    return ChannelSet.model_validate({"units": units, **fields})


def choices_of(kept: ChannelSet, units: str) -> ScopeChoices:
    """Return the choices of a set; its limits and offsets hold only for the units they were saved in."""
    fields = kept.model_dump(exclude={"units"})
    if kept.units != units:
        fields |= {
            "limits": {},
            "adjusted": {name: (scale, 0.0) for name, (scale, _) in kept.adjusted.items()},
        }
        factor = UNIT_SYSTEMS[units].length.factor / UNIT_SYSTEMS[kept.units].length.factor
        fields |= {"level": kept.level * factor, "hysteresis": kept.hysteresis * factor}
    return ScopeChoices(**fields)


class MathFields:
    """A field for another expression, and the ones that there are; `on_change` is called after a change."""

    def __init__(self, hello: Hello, choices: ScopeChoices, on_change: Callable[[], None]) -> None:
        self._names = {channel.name: place for place, channel in enumerate(hello.channels)}
        self._choices, self._on_change = choices, on_change
        with ui.expansion(tr("Computed channels")).props("dense").mark("scope-math"):
            with div("bench-row"):
                example = tr("as abs(x.position_error_m) * 1e6 [µm]")
                self._text = ui.input(example).props("spellcheck=false").mark("scope-expression")
                self._text.style("flex: 1 1 320px").on("keydown.enter", self._add)
                button(tr("Add"), self._add, "scope-expression-add")
            faint(
                tr(
                    "SI units; + - * / ** and {functions} (d: derivative by time)",
                    functions=", ".join(FUNCTIONS),
                )
            )
            self._list = Rebuilt(div("bench-column").mark("scope-expressions"), self._build)
            self._list.show(tuple(choices.expressions))

    def _build(self, expressions: tuple[str, ...]) -> None:
        for number, text in enumerate(expressions):
            with div("bench-row"):
                ui.label(text).classes("num").style("overflow-wrap: anywhere")
                remove = partial(self._remove, text)
                button(tr("Remove"), remove, f"scope-expression-remove-{number}", look="flat")

    def _add(self) -> None:
        text = str(self._text.value or "").strip()
        if not text or text in self._choices.expressions:
            return
        if len(self._choices.expressions) >= MAX_EXPRESSIONS:
            notify(tr("{most} channels are computed at most", most=MAX_EXPRESSIONS))
            return
        with errors_notified("warning"):
            math_channel(text, self._names)
            self._choices.expressions.append(text)
            self._text.set_value("")
            self._changed()

    def _remove(self, text: str) -> None:
        self._choices.expressions.remove(text)
        self._changed()

    def _changed(self) -> None:
        self._list.show(tuple(self._choices.expressions))
        self._on_change()
