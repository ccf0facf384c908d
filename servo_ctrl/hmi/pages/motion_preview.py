"""The path of the program in the editor, coloured by speed, with the place where the axes are."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from nicegui import ui

from servo_ctrl.hmi.parts import card
from servo_ctrl.hmi.path_picture import ON_DARK, ON_LIGHT, picture_of

if TYPE_CHECKING:
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.path_picture import PathPicture
    from servo_ctrl.hmi.program_check import Preview

HIGHEST_PX = 460


class PathPreview:
    """The card of the picture."""

    def __init__(self, bench: Bench, visitor: Visitor) -> None:
        self._bench, self._visitor = bench, visitor
        self._preview: Preview | None = None
        self._picture: PathPicture | None = None
        self._plane = (0, 0)
        self._number = 0
        self._drawn: object = None
        with card("Path from home", "preview"):
            self._place = (
                ui.element("div").mark("path").props('role=img aria-label="Path, coloured by speed"')
            )
            self._figures = ui.element("div").classes("bench-figures num").mark("preview-figures")

    def show(self, preview: Preview | None) -> None:
        """Another program; None: there is nothing to show."""
        self._preview = preview
        self._number += 1

    def refresh(self) -> None:
        """Draw what has changed."""
        key = (self._number, self._visitor.units.name, self._visitor.dark)
        if key != self._drawn:
            self._drawn = key
            self._draw()
            self._tell()
        self._move()

    def _draw(self) -> None:
        preview, units, dark = self._preview, self._visitor.units, self._visitor.dark
        self._place.clear()
        self._picture = None
        if preview is None:
            return
        self._plane = _plane(preview)
        picture = picture_of(
            preview.position_m[:, list(self._plane)], preview.speed_m_s, units.length, dark=dark
        )
        shape = picture.width_m / picture.height_m
        with self._place, ui.element("div").classes("bench-path"):
            with ui.element("div").classes("bench-path-area") as area:
                area.style(f"aspect-ratio: {shape:.4f}; max-width: {HIGHEST_PX * shape:.0f}px")
                ui.html(picture.svg, sanitize=False)
                for tick in picture.up:
                    ui.label(tick.text).classes("bench-tick up num").style(f"top: {tick.share:.2f}%")
                for tick in picture.across:
                    ui.label(tick.text).classes("bench-tick across num").style(f"left: {tick.share:.2f}%")
                self._here = ui.element("i").classes("bench-here").style("display: none")
            with ui.element("div").classes("bench-row apart bench-faint").style("font-size: 12px"):
                names = [preview.axes[axis] for axis in self._plane]
                ui.label(f"{names[0]} to the right, {names[1]} upwards, {units.length.unit}")
                with ui.element("div").classes("bench-row num"):
                    ui.label("0")
                    colours = ", ".join(ON_DARK if dark else ON_LIGHT)
                    ui.element("div").classes("bench-ramp").style(
                        f"background: linear-gradient(90deg, {colours})"
                    )
                    ui.label(units.velocity.with_unit(preview.top_speed_m_s))
        self._picture = picture

    def _tell(self) -> None:
        self._figures.clear()
        preview, length = self._preview, self._visitor.units.length
        if preview is None:
            return
        spans = [
            f"{name} {length.text(lowest_m)} \N{HORIZONTAL ELLIPSIS} {length.with_unit(highest_m)}"
            for name, lowest_m, highest_m in zip(
                preview.axes, preview.lowest_m, preview.highest_m, strict=True
            )
        ]
        with self._figures:
            for name, text in (
                ("time", f"{preview.duration_s:.1f} s"),
                ("steps", str(len(preview.steps))),
                ("way", length.with_unit(preview.length_m)),
                ("extents", "; ".join(spans)),
            ):
                with ui.element("div"):
                    ui.label(name).classes("bench-faint").style("font-size: 12px")
                    ui.label(text)

    def _move(self) -> None:
        """The mark goes to where the axes are."""
        preview, picture, rows = self._preview, self._picture, self._bench.link.rows
        if preview is None or picture is None or not len(rows):
            return
        place_m = []
        for axis in self._plane:
            try:
                place_m.append(float(rows.column(f"{preview.axes[axis]}.motor_position_m", rows.end - 1)[-1]))
            except KeyError:
                return
        share = picture.share_of(place_m[0], place_m[1]) if all(map(math.isfinite, place_m)) else None
        if share is None:
            self._here.style("display: none")
        else:
            self._here.style(f"display: block; left: {share[0]:.2f}%; top: {share[1]:.2f}%")


def _plane(preview: Preview) -> tuple[int, int]:
    """The two axes that move furthest, in machine order; one axis alone is drawn over itself."""
    if len(preview.axes) == 1:
        return (0, 0)
    first, second = sorted(np.argsort(np.ptp(preview.position_m, axis=0), kind="stable")[-2:].tolist())
    return (first, second)
