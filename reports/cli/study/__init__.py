"""``dess study``: run a study into a results folder; show, compare and bundle results."""

import typer

from reports.cli.settings import command
from reports.cli.study import diff, export, run, show

app = typer.Typer(
    help="Run studies (policies x design points x replications), show and compare results."
)
command(app, "run")(run.run)
command(app, "show")(show.show)
command(app, "diff")(diff.diff)
command(app, "export")(export.export)
