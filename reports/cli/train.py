"""``dess train``: train a policy into a folder."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from dess.base.commands import command_line, command_options
from dess.base.errors import InputError, shown
from dess.base.libraries import missing, needs
from dess.reports.cli import console, options
from dess.reports.cli.options import SetOption, add_command, parse_setting

if TYPE_CHECKING:
    from dess.policies.learner.training import Training

app = typer.Typer()
MEASURED = 5.0  # seconds of training after which it is said how long it will take


@add_command(app)
def train(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", autocompletion=options.complete_configs)
    ],
    out: Annotated[Path, typer.Option(metavar="DIR")],
    resume: Annotated[bool, typer.Option("--resume")] = False,
    device: Literal["auto", "cpu", "cuda"] = "auto",
    seed: int | None = None,
    settings: SetOption = None,
    scenario: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", autocompletion=options.complete_scenarios)
    ] = None,
    start: Annotated[str | None, typer.Option("--from", metavar="POLICY|DIR")] = None,
    yes: Annotated[bool, typer.Option("--yes")] = False,
) -> None:
    """Train a policy into a folder; Ctrl-C saves it, --resume continues exactly.

    After the first ticks it prints how long this machine will take. A small network is computed in
    one thread; the environment variable OMP_NUM_THREADS sets another number.

    Args:
        name: The name of a shipped config, or a TOML file.
        out: Folder of the training.
        resume: Continue the training in the folder.
        device: auto uses CUDA if a device is available.
        seed: Seed in place of the seed of the config.
        scenario: Scenario in place of that, or of the seas, of the config.
        start: Trained policy whose weights the training begins with; with --resume, it has begun.
        yes: Train even if it takes more memory than is available.
    """
    from dess.policies.learner.config import CHECKPOINT, load_config, resume_command
    from dess.policies.registry import folder_of

    fields = dict(parse_setting(text) for text in settings or [])
    changes: dict[str, Any] = {}
    if seed is not None:
        changes["seed"] = seed
    if scenario is not None:
        changes |= {"scenario": scenario, "seas": (), "evaluation_seas": ()}
    config = load_config(name, fields, **changes)
    start_folder = folder_of(start or "")
    if start and not start_folder:
        raise InputError("--from", f"{shown(start)} is no trained policy", "one, or its folder")
    needs("learning", "dess train")
    from dess.policies.learner.session import EVENTS, train
    from dess.policies.learner.training import DivergenceError

    def announce(memory: int) -> None:
        """Print how much memory [bytes] the missions take, and how to see the curves."""
        view = missing("tensorboard", "a live view of the curves")
        what = "missions of a tick"
        if config.algorithm == "dqn":
            what = "replay memory"
        console.print_text(f"{what}: {memory / 2**20:,.0f} MiB", sys.stderr)
        console.print_text(
            view or f"curves: tensorboard {command_options(logdir=out / EVENTS)}", sys.stderr
        )

    command = resume_command(config, name, out, device)
    try:
        with console.compile_notice(), _training_bar(config.ticks) as progress:
            training = train(
                config,
                out,
                resume=resume,
                device=device,
                accept_size=yes,
                start=str(start_folder or ""),
                announce=announce,
                progress=progress,
            )
    except KeyboardInterrupt:  # a second signal, or one before the first tick
        if not (out / CHECKPOINT).exists():
            raise
        line = f"interrupted: the last checkpoint is kept; continue with {command}"
        raise console.Interruption(line) from None
    except DivergenceError as error:
        raise typer.Exit(console.print_failure(f"dess: error: {error}", 1)) from None
    if not training.done:
        raise console.Interruption(
            f"interrupted at tick {training.tick:,} of {config.ticks:,}: the policy so far is "
            f"{command_options(policy=out)}; continue with {command}"
        )
    console.print_text(
        f"{out}: {training.updates} updates, {training.uav_slots} UAV-slots in "
        f"{training.seconds:.0f} s; best product {training.best_score:.3f} in selection"
    )
    evaluated = command_line("evaluate", policy=[out, "greedy"])
    console.print_text(f"compare: {evaluated}")


@contextmanager
def _training_bar(ticks: int) -> "Iterator[Callable[[Training, int], None]]":
    """Progress of a training, with the metrics of its last evaluation and how long it will take."""
    from dess.analysis import numbers

    with console.progress_bar("tick", ticks) as bar:
        first: tuple[int, float] | None = None  # without the first tick, which compiles
        is_said = False

        def show(training: "Training", done: int) -> None:
            nonlocal first, is_said
            first = first or (training.tick, training.seconds)
            ticks_done = training.tick - first[0]
            seconds = training.seconds - first[1]
            if not is_said and ticks_done >= 2 and seconds > MEASURED:
                seconds_per_tick = seconds / ticks_done
                is_said = True
                pace = numbers.format_seconds(seconds_per_tick)
                rest = numbers.format_duration(seconds_per_tick * (ticks - training.tick))
                bar.write(
                    f"on this machine: {pace} a tick, about {rest} to go",
                    file=sys.stderr,
                )
            if bar.n == 0:  # a resumed training begins at its tick
                bar.initial = bar.n = bar.last_print_n = training.tick - done
            bar.update(training.tick - bar.n)
            if training.curve:
                last = training.curve[-1]
                bar.set_postfix(
                    phase=last["phase"],
                    success=f"{last['evaluation_success']:.3f}",
                    product=f"{last['evaluation_collection_ratio_and_communication']:.3f}",
                    refresh=False,
                )

        yield show
