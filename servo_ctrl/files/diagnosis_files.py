"""Names in the directory of a diagnosis, which `reconcile diagnose` writes and the page reads."""

VERDICT_FILE = "verdict.json"
MODEL_FILE = "model.toml"
REPORT_FILE = "report.html"
