"""The path of the edited program, coloured by speed, with a ring where the axes are."""

import numpy as np
from nicegui import ui

from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.motion.path_picture import PathPicture, path_picture
from servo_ctrl.hmi.motion.programs import Preview
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.live_elements import LivePlace
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import ELLIPSIS, captioned, card, div, named

MAX_HEIGHT_PX = 460
"""Bounds the height of the picture on a wide screen, pixels; chosen: the height of the form beside it."""


class PathPreview:
    """The card of the path."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._preview: Preview | None = None
        self._picture: PathPicture | None = None
        self._ring: LivePlace | None = None
        self._plane = (0, 0)
        self._number = 0
        with card(tr("Path from home"), "preview"):
            place = div().mark("path").props("role=img")
            named(place, tr("Path, coloured by speed"))
            figures = div("bench-figures num").mark("preview-figures")
        self._parts = Rebuilt(place, self._draw), Rebuilt(figures, self._show_figures)

    def show(self, preview: Preview | None) -> None:
        """Show another program; None: no path."""
        self._preview = preview
        self._number += 1

    def refresh(self, _status: MachineStatus) -> None:
        """Draw the path where it has changed, and move the ring."""
        key = (self._number, self._page.look)
        for part in self._parts:
            part.show(key)
        self._move_ring()

    def _draw(self, _key: object) -> None:
        preview, (units, theme) = self._preview, self._page.look
        self._picture = None
        if preview is None:
            return
        self._plane = drawn_plane(preview)
        plane_m = preview.position_m[:, list(self._plane)]
        self._picture = picture = path_picture(plane_m, preview.speed_m_s, units.length, theme)
        ratio = picture.width_m / picture.height_m
        with div("bench-path"):
            with div("bench-path-area") as area:
                area.style(f"aspect-ratio: {ratio:.4f}; max-width: {MAX_HEIGHT_PX * ratio:.0f}px")
                ui.html(picture.svg, sanitize=False)
                for tick in picture.vertical:
                    ui.label(tick.text).classes("bench-tick up num").style(f"top: {tick.percent:.2f}%")
                for tick in picture.horizontal:
                    ui.label(tick.text).classes("bench-tick across num").style(f"left: {tick.percent:.2f}%")
                self._ring = LivePlace().classes("bench-here")
            with div("bench-row apart bench-faint").style("font-size: 12px"):
                names = [preview.axes[axis] for axis in self._plane]
                ui.label(
                    tr(
                        "{first} to the right, {second} upwards, {unit}",
                        first=names[0],
                        second=names[1],
                        unit=units.length.unit,
                    )
                )
                with div("bench-row num"):
                    ui.label("0")
                    gradient = f"linear-gradient(90deg, {', '.join(theme.speeds)})"
                    div("bench-ramp").style(f"background: {gradient}")
                    ui.label(units.velocity.with_unit(preview.run.path_speed_m_s))

    def _show_figures(self, _key: object) -> None:
        preview, length = self._preview, self._page.units.length
        if preview is None:
            return
        run = preview.run
        extents = [
            f"{axis} {length.text(lowest_m)} {ELLIPSIS} {length.with_unit(highest_m)}"
            for axis, lowest_m, highest_m in zip(preview.axes, run.lowest_m, run.highest_m, strict=True)
        ]
        captioned(tr("time"), f"{run.duration_s:.1f} s")
        captioned(tr("steps"), str(preview.steps))
        captioned(tr("path length"), length.with_unit(run.length_m))
        captioned(tr("extents"), "; ".join(extents))

    def _move_ring(self) -> None:
        preview, picture, rows = self._preview, self._picture, self._page.link.rows
        if preview is None or picture is None or self._ring is None:
            return
        x_m, y_m = (rows.newest(f"{preview.axes[axis]}.motor_position_m") for axis in self._plane)
        place = picture.place_of(x_m, y_m)
        if place is None:
            self._ring.hide()
        else:
            self._ring.show(*place)


def drawn_plane(preview: Preview) -> tuple[int, int]:
    """Return the two axes of the longest travel, in the order of the machine; a single axis twice."""
    if len(preview.axes) == 1:
        return (0, 0)
    first, second = sorted(np.argsort(np.ptp(preview.position_m, axis=0), kind="stable")[-2:].tolist())
    return (first, second)
