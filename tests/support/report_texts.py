"""The texts of a diagnosis' report, read from the code of reconcile, which the page never imports."""

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

from message_templates import numbered, template_of, texts_inside
from report_sentences import report_sentences

import reconcile.report
from reconcile.location.coordinates import PHASES, coordinates
from reconcile.report.console import COLOURS as VERDICTS
from reconcile.report.traces import MODEL_NAMES
from reconcile.report.words import CHANNEL_NAMES, display_name

ROOM = Path(reconcile.report.__file__).parent
MODULES = (
    *("figures", "replay_figures", "report", "sections", "traces", "unnamed_curve", "unnamed_map"),
    "words",
)
"""Those that write the page; `report_sentences` has the notes and the next experiment, of other rooms."""
NO_TEXTS = {'data-member="{0}" data-number="{1}"{2}', "kg m^2", "system-ui, sans-serif"}
ON_A_TERMINAL = {
    "{0}{1} from {2} to {3} {4}: {5} {6} (the report draws it)",
    "force over position and velocity from {0} to {1} {2} (the report draws it)",
}
SHORT = {
    *("Fit", "Recording", "Spectrum", "From {0}", "verdict: {0}", "{0} effects", "{0} recordings", "{0} RMS"),
    *(
        "RMS",
        "axis",
        "confidence {0}",
        "could be",
        "in",
        "instead",
        "measured",
        "nominal",
        "over",
        "parameter",
    ),
    *(
        "part",
        "recording",
        "refitted",
        "rigid",
        "share",
        "why not",
        "{0} and {1}",
        "{0} ({1})",
        "{0} a turn",
        "the run time",
    ),
    *("autocorrelation", "backwards", "deviation", "error, {0}", "forwards", "found", "mass", "newton"),
    *("newton metre", "no scale", "noise", "position", "recorded", "torque", "unexplained", "everywhere"),
    *("Stribeck force", "Stribeck speed", "distance", "harmonic", "order", "speed"),
    "Explains {0} % of what no value of the nominal model explains (on blocks left out of the mean)",
}
"""Single words, and what is put together from them."""
_TAG = re.compile(r"<[^<>]*>")
_PLACE = re.compile(r"\{\d\}")
_WORD = re.compile(r"[A-Za-z]{2,}")


def report_texts() -> set[str]:
    """Return the templates {0}, {1} ... of the texts between the tags of the page."""
    found = {*SHORT, *MODEL_NAMES.values(), *CHANNEL_NAMES.values(), *VERDICTS, *_coordinates()}
    for name in MODULES:
        for text in _texts(ast.parse((ROOM / f"{name}.py").read_text("utf-8"))):
            for piece in _TAG.split(text):
                shown = numbered(piece.strip(" ;:."))
                if " " in _PLACE.sub("", shown).strip() and _WORD.search(_PLACE.sub("", shown)):
                    found.add(shown)
    return (found - NO_TEXTS - ON_A_TERMINAL) | report_sentences()


def _coordinates() -> set[str]:
    """Return the names of the coordinates over which residuals are shown, and of the phases of a motion."""
    module = ast.parse(inspect.getsource(coordinates))
    makers = {"_linear", "_labelled", "_logarithmic"}
    calls = (node for node in ast.walk(module) if isinstance(node, ast.Call))
    names = (call.args[0] for call in calls if getattr(call.func, "id", "") in makers)
    texts = {display_name(name.value) for name in names if isinstance(name, ast.Constant)}
    return texts | set(PHASES) | {"{0} a pole pair", "{0} a grating period"}


def _texts(module: ast.Module) -> Iterator[str]:
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef):
            left_out = {id(one.value) for one in ast.walk(node) if isinstance(one, ast.Expr)}
            for part in ast.walk(node):
                left_out |= texts_inside(part)
            yield from (template_of(part) for part in ast.walk(node) if id(part) not in left_out)
