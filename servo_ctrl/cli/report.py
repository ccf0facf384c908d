"""`servo-ctrl report`: report of a recorded run as a web page and as a PDF."""

from pathlib import Path
from typing import Annotated

import typer


def report(
    run: Annotated[Path, typer.Argument(help="Recording: the directory given to `servo-ctrl run --record`.")],
    out: Annotated[Path, typer.Option(help="Directory of the report; made if absent.")],
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing report.")] = False,
) -> None:
    """Make a report of a recorded run: `report.html` and `report.pdf`, with the same content.

    Both say what ran and how it ended, how well each axis followed, with what force, how its reversals
    compare with J_required, and what compensation was in use. Circles are evaluated quadrant by quadrant,
    targets that were approached from both sides, by the terms of ISO 230. The page is one file that opens
    without a network; zoom into a picture by dragging. docs/reports.md explains every figure.

    A recording that was cut off, by a power failure or a `kill -9`, is evaluated as far as it goes.

    Example:  servo-ctrl run --machine M --bus B --program P --record out/run;
    servo-ctrl report out/run --out out/report
    """
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn

    from servo_ctrl.report.html_page import page
    from servo_ctrl.report.pdf_pages import pdf
    from servo_ctrl.report.recorded_run import read_run
    from servo_ctrl.report.write import HTML_FILE, PDF_FILE, check_free, report_of, write_report

    check_free(out, force=force)
    console = Console(stderr=True)
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), console=console, transient=True) as bar:
        task = bar.add_task("reading the recording ...", total=None)
        recorded = read_run(run)
        bar.update(task, description=f"evaluating {len(recorded.time_s)} rows ...")
        content = report_of(recorded)
        bar.update(task, description="drawing the page ...")
        html = page(content)
        bar.update(task, description="drawing the PDF ...")
        document = pdf(content)
    write_report(out, html, document)
    typer.echo(f"{content.title}: {content.verdict}")
    typer.echo(f"page: {out / HTML_FILE}")
    typer.echo(f"PDF:  {out / PDF_FILE}")
