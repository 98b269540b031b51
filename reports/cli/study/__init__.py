"""``dess study``: run a study into a results folder; show, compare and bundle results."""

import typer

from reports.cli.study import diff, export, run, show

app = typer.Typer(
    help="Run studies (policies x design points x replications), show and compare results."
)
app.command("run")(run.run)
app.command("show")(show.show)
app.command("diff")(diff.diff)
app.command("export")(export.export)
