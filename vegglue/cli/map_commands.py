"""The shell of where a case comes from and where it goes: new, export."""

from pathlib import Path
from typing import Annotated, Literal

import typer

import vegglue
from vegglue.cli.hearing import heard
from vegglue.cli.options import FLAG, RUNS, Config, Json, Quiet, Runs, Trust
from vegglue.cli.output import command_line, print_object
from vegglue.errors import shown_path

FORMS: tuple[Literal["csv", "geotiff", "netcdf"], ...] = ("csv", "geotiff", "netcdf")


def new_command(
    name: Annotated[str, typer.Argument(help="Name of the folder to be made.", show_default=False)],
    length: Annotated[float, typer.Option(help=r"Length of the reach \[m].")] = 40.0,
    width: Annotated[float, typer.Option(help=r"Width of its floor \[m].")] = 3.0,
    slope: Annotated[float, typer.Option(help="Fall of the bed per length [-].")] = 0.001,
    depth: Annotated[float, typer.Option(help=r"Depth of the water at the outlet \[m].")] = 0.9,
    discharge: Annotated[float, typer.Option(help=r"Discharge \[m3/s].")] = 1.5,
    plants: Annotated[bool, typer.Option(metavar=FLAG, help="Whether there is a patch of plants.")] = True,
    folder: Annotated[Path, typer.Option(help="Folder to make it in.")] = Path("."),
    as_object: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make a working folder: a commented case of a straight reach, and example measurements that belong to it."""
    from vegglue.workflow.new import Reach

    with heard(quiet, as_object):
        case = vegglue.new(name, Reach(length, width, slope, depth, discharge, plants), folder=folder)
    config = shown_path(case.source)
    if as_object:
        print_object({"config": config, "case": case.name, "parameters": list(case.parameters)})
        return
    print(f"{config}: a reach of {length:g} m with computed measurements beside it; put your own in their place.")
    if not quiet:
        print(f"Next: {command_line('check', config)}, then {command_line('run', config)}")


def export_command(
    config: Config,
    only: Annotated[
        Literal["csv", "geotiff", "netcdf"] | None, typer.Option(help="The one form to write; all if not given.")
    ] = None,
    runs: Runs = RUNS,
    as_object: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Write the flow and the stations for maps and tables: CSV, GeoTIFF, netCDF (UGRID); on the map, with a frame."""
    case = vegglue.load_case(config, trust)
    with heard(quiet, as_object) as watch:
        found = vegglue.export(case, runs=runs, forms=(only,) if only else FORMS, watch=watch)
    if as_object:
        print_object({"files": found.files, "parameters": found.parameters})
        return
    print(f"Flow of {found.parameters}, {len(found.files)} files in {found.files[0].parent}:")
    for path in found.files:
        print(f"  {path.name}")
