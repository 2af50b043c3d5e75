"""The shell of twins: make data with a hidden effect, and open the seal."""

from pathlib import Path
from typing import Annotated

import typer

import vegglue
from vegglue.cli.options import RUNS, Force, Json, Quiet, Runs, Trust
from vegglue.cli.output import command_line, print_object
from vegglue.errors import shown_path


def twin_command(
    config: Annotated[Path, typer.Argument(help="The case whose stations and errors are used.", show_default=False)],
    to: Annotated[Path, typer.Option(help="Folder for measurements, config and sealed answer.", show_default=False)],
    hide: Annotated[
        list[str] | None,
        typer.Option(help="EFFECT, EFFECT=SIZE, unlisted:NAME, bad_probe, nothing, or ? for any; may be repeated."),
    ] = None,
    snr: Annotated[float, typer.Option(min=0.1, help="How visible an effect without a size is made.")] = 6.0,
    noise: Annotated[str, typer.Option(help="white, ar1:0.5 or understated:1.5.")] = "white",
    seed: Annotated[int, typer.Option(min=0, help="Decides parameters, errors and what `?` is.")] = 1,
    as_object: Json = False,
    quiet: Quiet = False,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Make measurements with a hidden effect, to play blind against `diagnose`; the answer is sealed."""
    parent = vegglue.load_case(config, trust)
    case = vegglue.make_twin(parent, to, hide=hide or ["?"], snr=snr, noise=noise, seed=seed, force=force)
    from vegglue.measurements.observations import read_observations

    target = shown_path(case.source)
    measurements = int(read_observations(case).table["used"].sum())
    if as_object:
        print_object({"config": target, "folder": to, "measurements": measurements})
        return
    print(f"{target}: {measurements} measurements.")
    if not quiet:
        print(f"Next: {command_line('diagnose', target, trust=trust)}, then {command_line('reveal', to, trust=trust)}")


def reveal_command(
    folder: Annotated[Path, typer.Argument(help="Folder that `vegglue twin` made.", show_default=False)],
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Open the seal of a twin, and say how well its diagnosis guessed."""
    lines = vegglue.reveal(folder, runs=runs, trust=trust)
    if as_object:
        print_object({"folder": folder, "sentences": lines})
        return
    for line in lines:
        print(f"- {line}")
