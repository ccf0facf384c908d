"""The pictures of the friction study: learned functions, errors at quadrants A and B, contours."""

from pathlib import Path

from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning.types import Learned
from servo_ctrl.metrology.circles import AXES
from servo_ctrl.plots.learned import LearnedAxis, plot_learned
from studies.feng_2015.plots import plot_comparison, plot_contours
from studies.feng_2015.study import FrictionStudy
from studies.feng_2015.variants import OBSERVER, PULSE, WITHOUT

DRAWN = (WITHOUT, PULSE, OBSERVER)
QUADRANTS = {"x": "A", "y": "B"}
"""The quadrant at which an axis reverses, by the letters of the paper; C and D are alike."""


def draw_study(machine: Path, study: FrictionStudy, out: Path) -> list[Path]:
    """Draw all pictures; return their files. Raises OSError."""
    config = load_machine(machine)
    window_s = config.monitoring.window_s
    sources: list[tuple[str, dict[str, Learned]]] = [
        (name, {axis: entry.learned for axis, entry in twin.axes.items()})
        for name, twin in (("paper", study.paper), ("fast", study.fast))
    ]
    if study.bus is not None:
        sources.append(("bus", study.bus.axes))
    pictures = []
    for name, learned in sources:
        pictures.append(out / f"learned_{name}.png")
        axes = [
            LearnedAxis(axis, entry, learning_settings(config, axis).amplitude_max_m_s)
            for axis, entry in learned.items()
        ]
        plot_learned(pictures[-1], axes, f"{config.machine.name}: what was learned, {name}")
    results = {name: study.results[name] for name in DRAWN}
    circles = {name: result.circles for name, result in results.items()}
    quadrants = {
        f"{circle.label}, quadrant {QUADRANTS[axis]} ({axis} reverses)": [
            several[place].error_traces[axis]._replace(label=name) for name, several in circles.items()
        ]
        for place, circle in enumerate(circles[WITHOUT])
        for axis in AXES
    }
    plot_comparison(out / "quadrants.png", quadrants, window_s)
    contours = {
        circle.label: [several[place].contour._replace(label=name) for name, several in circles.items()]
        for place, circle in enumerate(circles[WITHOUT])
    }
    plot_contours(out / "contours.png", contours)
    shapes = {
        f"{shape.name}, {shape.axis} reverses": [
            result.shapes[place].error_trace._replace(label=name) for name, result in results.items()
        ]
        for place, shape in enumerate(results[WITHOUT].shapes)
    }
    plot_comparison(out / "s_shapes.png", shapes, window_s)
    return [*pictures, *(out / f"{name}.png" for name in ("quadrants", "contours", "s_shapes"))]
