"""``dess policies``, ``dess scenarios`` and ``dess studies``: the names that commands accept."""

import typer

from reports.cli import console

app = typer.Typer()


@app.command()
def policies() -> None:
    """List the policies."""
    from policies.registry import descriptions

    console.print_list(descriptions().items())


@app.command()
def scenarios() -> None:
    """List the shipped scenarios."""
    from dess import scenario_names

    console.print_list((name, "") for name in scenario_names())


@app.command()
def studies() -> None:
    """List the shipped studies."""
    from analysis.study.study import study_descriptions

    console.print_list(study_descriptions().items())
