"""A finished result of another model as one value, whatever code wrote it; and the netCDF files of two of these codes.

Each format has one small file with a reader (path) -> `ModelResult`: `hec_ras.py`, `selafin.py`, `ugrid.py` and
`delft3d_trim.py`; `finished_results.py` finds the right one. All read the final state.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import h5py
import numpy as np
from scipy.io import netcdf_file

from vegglue.arrays import Array, Mask
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import UNITS, unit_named
from vegglue.importers.import_notes import FileNote, ImportNote, Noted

RoughnessKind = Literal["manning", "strickler", "chezy", "nikuradse", "not-stated"]
# Depth below which a point counts as dry [m]. Chosen: codes keep films of up to some millimetres on dry land, TELEMAC
# also negative depths.
DRY_DEPTH = 0.005
FASTEST_FLOW = 20.0  # of a river [m/s]: what is faster marks no value
FILLS_OF_CODES = (-999.0, -999.999, -9999.0, -99999.0)  # that codes write without declaring them


@dataclass(frozen=True, eq=False)
class ModelResult:
    """The final state of a model run, at the places where its velocities lie.

    Attributes
    ----------
    code : str
        The program, such as HEC-RAS.
    x, y : ndarray (n,)
        Places on the map of the file [m].
    bed, depth, level : ndarray (n,)
        [m]; depth is 0 and level NaN where it is dry.
    u, v : ndarray (n,)
        Depth-averaged velocity to the east and to the north of that map [m/s], 0 where it is dry.
    corners : ndarray (k, 2)
        Nodes of the mesh [m]: how far it reaches.
    roughness : ndarray (n,) or None
        In the unit of its kind [s m^(-1/3), m^(1/3)/s, m^(1/2)/s, m]; None if the file has none.
    crs : str
        Coordinate system as the file states it, '' if it does not.
    time : str
        Of the final state, as the file states it.
    notes : tuple of FileNote
        What was converted or left out.
    """

    code: str
    x: Array
    y: Array
    bed: Array
    depth: Array
    level: Array
    u: Array
    v: Array
    corners: Array
    roughness: Array | None = None
    roughness_kind: RoughnessKind = "not-stated"
    crs: str = ""
    time: str = ""
    notes: tuple[FileNote, ...] = field(default=())

    @property
    def wet(self) -> Mask:
        return self.depth > 0.0

    def manning(self, kind: RoughnessKind | None = None) -> Array | None:
        """n = 1/k_st, n = h^(1/6) / C, or n = k_s^(1/6) / 26 (n,) [s m^(-1/3)]; None if nothing states the law.

        kind: the law instead of the file's. NaN where the file has no value, or C is needed and it is dry.
        """
        kind = kind or self.roughness_kind
        if self.roughness is None or kind == "not-stated":
            return None
        with np.errstate(divide="ignore", invalid="ignore"):
            one = np.where(self.roughness > 0.0, self.roughness, np.nan)
            if kind == "manning":
                return one
            if kind == "strickler":
                return 1.0 / one
            if kind == "nikuradse":
                return one ** (1.0 / 6.0) / 26.0
            return np.where(self.wet, self.depth ** (1.0 / 6.0) / one, np.nan)


def model_result(
    code: str, x: Array, y: Array, bed: Array, level: Array, depth: Array, u: Array, v: Array, **more: Any
) -> ModelResult:
    """A finished result with dry places as `ModelResult` describes them.

    Places without a bed, and those under water without a level, depth or velocity, are left out; without level and
    depth it is dry. The last two are counted in the notes.

    Parameters
    ----------
    x, y : ndarray (n,)
        [m]
    bed, level, depth : ndarray (n,)
        [m], NaN if unknown.
    u, v : ndarray (n,)
        [m/s], NaN if unknown.
    **more
        Further fields of ModelResult.
    """
    placed = np.isfinite(x) & np.isfinite(y) & np.isfinite(bed)
    unknown, stated_dry = ~np.isfinite(level) & ~np.isfinite(depth), np.nan_to_num(depth, nan=np.inf) <= DRY_DEPTH
    wet = ~unknown & ~stated_dry
    lost = placed & wet & ~(np.isfinite(level + depth) & (np.hypot(u, v) <= FASTEST_FLOW))
    known = placed & ~lost
    notes = [ImportNote(Noted.PLACES_LOST, int(lost.sum()))] if lost.any() else []
    if unstated := int((placed & unknown).sum()):
        notes.append(ImportNote(Noted.PLACES_DRY, unstated))
    more["notes"] = (*more.get("notes", ()), *notes)
    roughness = more.pop("roughness", None)
    return ModelResult(
        code, x[known], y[known], bed[known], np.where(wet, depth, 0.0)[known], np.where(wet, level, np.nan)[known],
        np.where(wet, u, 0.0)[known], np.where(wet, v, 0.0)[known],
        roughness=None if roughness is None else roughness[known], **more,
    )  # fmt: skip


def lacking_fields(found: Mapping[str, Array]) -> list[str]:
    """Fields that a result lacks: u, v, and those of bed, level and depth if it has fewer than two of these."""
    of_three = [key for key in ("bed", "level", "depth") if key not in found]
    return [key for key in ("u", "v") if key not in found] + (of_three if len(of_three) > 1 else [])


def bed_level_depth(found: Mapping[str, Array]) -> tuple[Array, Array, Array]:
    """z_b, z_s = z_b + h, and h (n,) [m], from two of them."""
    bed = found["bed"] if "bed" in found else found["level"] - found["depth"]
    level = found["level"] if "level" in found else bed + found["depth"]
    return bed, level, found["depth"] if "depth" in found else level - bed


def without_marks(values: Array) -> Array:
    """Numbers as they stand in a file, NaN for those that codes write where there is no value."""
    with np.errstate(invalid="ignore"):
        marked = np.abs(values) > 1e30
        for mark in FILLS_OF_CODES:  # to single precision, in which most of them are written
            marked |= np.abs(values - mark) <= 1e-7 * abs(mark)
    return np.where(marked, np.nan, values)


def si_value(unit: str) -> float:
    """SI value of a unit of length or velocity [SI unit per unit], 0 of another one."""
    known = ((quantity, unit_named(unit.replace("_", " "), quantity)) for quantity in ("length", "velocity"))
    return next((UNITS[quantity][name] for quantity, name in known if name), 0.0)


def text_of(value: Any) -> str:
    """An attribute of a file as text; '' if there is none."""
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size else ""
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return "" if value is None else str(value)


@dataclass(frozen=True)
class NetcdfVariable:
    """A variable of a netCDF file: its values are read when they are asked for."""

    source: Any
    shape: tuple[int, ...]
    attributes: Mapping[str, Any]

    def text(self, name: str) -> str:
        return text_of(self.attributes.get(name))

    def of_time(self, times: int) -> bool:
        """Whether the first of its axes is that of so many times."""
        return len(self.shape) > 1 and self.shape[0] == times

    def values(self, times: int = 0) -> Array:
        """Values in SI at the last of so many times, NaN where none is."""
        raw = self.numbers(times).astype(np.float64)
        named = [self.attributes[one] for one in ("_FillValue", "missing_value") if one in self.attributes]
        marks = [float(np.ravel(one)[0]) for one in named]
        low, high = np.ravel(self.attributes.get("valid_range", (-np.inf, np.inf)))[[0, -1]].astype(np.float64)
        low = float(np.ravel(self.attributes.get("valid_min", low))[0])
        high = float(np.ravel(self.attributes.get("valid_max", high))[0])
        none = np.isin(raw, marks) | (raw < low) | (raw > high)
        raw = without_marks(np.where(none, np.nan, raw))
        scale = float(np.ravel(self.attributes.get("scale_factor", 1.0))[0])
        offset = float(np.ravel(self.attributes.get("add_offset", 0.0))[0])
        return (raw * scale + offset) * (self.in_si or 1.0)

    @property
    def in_si(self) -> float:
        """SI value of its unit, of a length or a velocity; 1 without a unit, 0 for another one."""
        stated = self.text("units").strip()
        return si_value(stated) or float(stated in ("", "1", "-"))

    def numbers(self, times: int = 0) -> np.ndarray[Any, Any]:
        """Numbers as they stand in the file, at the last of so many times."""
        return np.asarray(self.source[-1] if self.of_time(times) else self.source[()])


@contextmanager
def netcdf_variables(path: Path) -> Iterator[dict[str, NetcdfVariable]]:
    """Within, the variables of a netCDF file, classic or of version 4, by name."""
    with path.open("rb") as file:
        classic = file.read(3) == b"CDF"
    if classic:
        with netcdf_file(path, mmap=False) as file:
            yield {
                name: NetcdfVariable(one.data, one.data.shape, one._attributes) for name, one in file.variables.items()
            }
        return
    with h5py.File(path) as file:
        yield {
            name: NetcdfVariable(one, one.shape, dict(one.attrs))
            for name, one in file.items()
            if isinstance(one, h5py.Dataset)
        }


def why_no_variables(path: str) -> str | None:
    """Read all variables and drop them: None, as the next reader meets its errors, which harm nothing."""
    try:
        with netcdf_variables(Path(path)) as variables:
            for one in variables.values():
                one.numbers()
    except MemoryError:
        raise
    except Exception:  # on damaged files libraries raise anything
        return None
    return None


def last_time(time: NetcdfVariable | None) -> str:
    """The last time with its unit; '' if there is none."""
    return "" if time is None else f"{float(np.ravel(time.numbers())[-1]):g} {time.text('units')}"


def refuse_degrees(path: Path, x: NetcdfVariable) -> None:
    """Raise InputError if places are given in degrees."""
    if "degree" in x.text("units").lower():
        raise InputError(f"{shown_path(path)}: expected places in metres, got degrees; project the mesh first.")
