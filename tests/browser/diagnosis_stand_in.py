"""Replaces `reconcile diagnose`: the same arguments, lines and files, without the computation.

It goes on to the next step when a file with its number appears beside the model.
"""

import json
import sys
import time
from pathlib import Path

STEPS = (
    "reading",
    "checking timing and sensors",
    "axis x: force",
    "axis x: scale less motor",
    "locating",
    "report",
)
REPORT = """<!doctype html><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'">
<main><h1>Report</h1><h3>Over time</h3><p id="result">nothing</p></main>
<script type="application/json" id="figures">{}</script><script>
let reached = "no";
try { reached = parent.document.title; } catch (error) { reached = "no"; }
document.getElementById("result").textContent = "reached the page: " + reached;
</script>"""
LEVELS = {"train": 1.0, "heldout": 1.0}
VERDICT = {
    "verdict": "effects",
    "notes": ["run: a note"],
    "findings": [
        {
            "axis": "x",
            "effect": "stribeck_friction",
            "confidence": 0.97,
            "equivalent": ["coulomb_friction"],
            "parameters": {"force_n": {"value": 2.0, "ci95": [1.9, 2.1], "unit": "N"}},
            "heldout_gain": 0.4,
            "explanation": "friction falls towards rest",
            "runners_up": [{"effect": "backlash", "confidence": 0.01, "why_not": "it explains less"}],
        }
    ],
    "fit": {
        "x": {
            "force": {
                "unit": "N",
                "before": LEVELS,
                "refitted": LEVELS,
                "after": {"train": 1, "heldout": 0.25},
            }
        }
    },
}
LIMIT_S = 60.0


def main() -> None:
    recording, model = Path(sys.argv[1]), Path(sys.argv[sys.argv.index("--model") + 1])
    out = Path(sys.argv[sys.argv.index("--out") + 1])
    if recording.name == "broken":
        print(f"reconcile: {recording}: has no column time", flush=True)
        sys.exit(1)
    for number, text in enumerate(STEPS):
        print(json.dumps({"format": 1, "step": text, "done": number, "of": len(STEPS)}), flush=True)
        deadline_s = time.monotonic() + LIMIT_S
        while not (model.parent / f"step{number}").exists() and time.monotonic() < deadline_s:
            time.sleep(0.02)
    (out / "verdict.json").write_text(json.dumps(VERDICT))
    (out / "model.toml").write_text(model.read_text().replace("50.0", "51.5"))
    (out / "report.html").write_text(REPORT)


try:
    main()
except KeyboardInterrupt:
    sys.exit(130)
