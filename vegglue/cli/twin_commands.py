"""The shell of twins: make data with a hidden effect, and open the seal."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.cli.options import Runs, console
from vegglue.errors import InputError
from vegglue.storage.result_files import diagnosis_that_fits
from vegglue.twins.reveal import in_words
from vegglue.twins.twin import measured, opened, sealed, true_place, twin_base
from vegglue.twins.twin_files import SEAL, config_in, write_twin
from vegglue.workflow.run_folder import model_in


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
) -> None:
    """Make measurements with a hidden effect, to play blind against `diagnose`; the answer is sealed."""
    case = load_case(config)
    model = model_in(case)
    if not case.parameters:
        raise InputError(f"{config}: `parameters` expected a prior or more, got none; add one.")
    station, answer = measured(twin_base(model, true_place(len(model.names), seed)), hide or ["?"], snr, noise, seed)
    target = write_twin(case, to, station, sealed(answer))
    console.print(f"{target}: {int(station['used'].sum())} measurements. Next: vegglue diagnose {target}, then")
    console.print(f"vegglue reveal {to}")


def reveal_command(
    folder: Annotated[Path, typer.Argument(help="Folder that `vegglue twin` made.", show_default=False)],
    runs: Runs = Path("runs"),
) -> None:
    """Open the seal of a twin, and say how well its diagnosis guessed."""
    answer = opened(folder / SEAL)
    case = load_case(config_in(folder))
    diagnosis = diagnosis_that_fits(runs / case.name / "diagnosis.h5", case_hash(case))
    for line in in_words(answer, diagnosis):
        console.print(f"- {line}")
    if diagnosis is None:
        console.print(f"No diagnosis of it in {runs / case.name}: `vegglue diagnose {config_in(folder)}` makes one.")


TWIN_COMMANDS: tuple[tuple[str, Callable[..., None]], ...] = (("twin", twin_command), ("reveal", reveal_command))
