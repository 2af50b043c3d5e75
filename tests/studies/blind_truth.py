"""Truths of the blind study: what instruments would show at a site of the second solver that hides something."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import second_effects as effects
from second_channel import PAPER, SHORT, Channel, lie_of
from second_hidden_laws import LAW_DRAG, LAW_MIXING
from second_kernels import GRAVITY, KARMAN
from second_laws import Formulation
from second_solver import Field, Flow
from site_reach import EDDY_VISCOSITY, Truth, at, reach_of, steady_flow

from vegglue.case.schema import Case

CHANNELS = {"twin": SHORT, "campaign": PAPER}
# Cells of the truth [m]: what the model misses of it on a perfect site is then what it misses on 0.25 x 0.094 m. In the
# long channel the fourth edition had 0.5 x 0.1875 m: there a viscosity stood out by 5.9 standard errors between its
# patches that was the truth's own.
CELLS = {"twin": (0.25, 0.125), "campaign": (0.25, 0.125)}
# Change at which a flow counts as steady [m/s2]; what is left is about 5e-4 m/s.
SETTLED = 1e-5
# Small imperfections of a site, standard deviations or ranges: stems and discharges [share], probes and edges of
# patches [m], eddy viscosity over the stated one, floor of the bank law, logarithm above plants, bed among them.
STEMS, DISCHARGE, PROBE, EDGE, VISCOSITY = 0.12, 0.01, 0.02, 0.1, (0.5, 2.5)
BANK_FLOOR, UPPER, BARE = (1.1, 1.6), (0.85, 1.15), (45.0, 75.0)
# An imperfection is named rightly, with its sign, where it is as large: discharges, stems, viscosity [share]. One off
# by a fifth is some three standard errors long in the small channel, which the alarm does not see.
NAMED_DISCHARGE, NAMED_STEMS, NAMED_VISCOSITY = 0.004, 0.03, 0.2
Numbers = Mapping[str, float]


@dataclass(frozen=True)
class Site:
    """A site: what is true of it, discharges of its experiments as factors, by how much the first stations stood off
    across [m], and what a diagnosis may rightly find missing though nothing was hidden, by name with its size.
    """

    truth: Truth
    discharges: Mapping[str, float]
    shifts: Field
    also_true: Mapping[str, float]


def perfect_site(case: Case, study: str, theta: Numbers, stations: int) -> Site:
    """The site as its config has it."""
    channel = CHANNELS[study]
    truth = Truth(
        theta["n_b"], theta["k_s"], theta["phi"], theta["canopy_height"], {}, stems=(1.0,) * len(channel.patches),
        nu=theta["eddy_viscosity"], channel=channel,
    )  # fmt: skip
    return Site(truth, dict.fromkeys(case.experiments, 1.0), np.zeros(stations), {})


def site_of_nature(perfect: Site, case: Case, seed: int, hide: Sequence[str] = ()) -> Site:
    """A site like that with small imperfections, drawn anew for each seed; none of the kind that is hidden."""
    random = np.random.default_rng((seed, 11))
    truth, patches = perfect.truth, [patch.name for patch in case.plants.patches]
    stems = 1.0 + STEMS * random.standard_normal(len(patches))
    discharges = 1.0 + DISCHARGE * random.standard_normal(len(case.experiments))
    emergent, viscosity = float(random.integers(2)), float(np.exp(random.uniform(*np.log(VISCOSITY))))
    hidden = {name.partition("[")[0] for name in hide}
    stems = np.ones_like(stems) if "patch_density" in hidden else stems
    discharges = np.ones_like(discharges) if "discharge_error" in hidden else discharges
    emergent = 0.0 if "emergent_part" in hidden else emergent
    viscosity = 1.0 if "viscosity" in hidden else viscosity
    formulation = Formulation(
        bank_floor=float(random.uniform(*BANK_FLOOR)), emergent=emergent, upper=float(random.uniform(*UPPER)),
        bare=float(random.uniform(*BARE)),
    )  # fmt: skip
    mean = float(np.average(stems, weights=truth.channel.density))
    sizes = {f"patch_density[{name}]": each / mean - 1.0 for name, each in zip(patches, stems, strict=True)}
    sizes |= {f"discharge_error[{name}]": each - 1.0 for name, each in zip(case.experiments, discharges, strict=True)}
    off = discharges - 1.0
    sizes["discharge_error"] = float(off[np.abs(off).argmin()]) if np.ptp(np.sign(off)) == 0.0 else 0.0  # in each
    named = {
        name: float(size)
        for name, size in sizes.items()
        if abs(size) > (NAMED_STEMS if name.startswith("patch") else NAMED_DISCHARGE)
    }
    named |= {"viscosity": viscosity - 1.0} if abs(viscosity - 1.0) > NAMED_VISCOSITY else {}
    named |= {"emergent_part": emergent} if emergent else {}
    return Site(
        replace(
            truth,
            nu=EDDY_VISCOSITY * viscosity,
            stems=tuple(float(each) for each in stems),
            bed_seed=seed,
            edges=_moved(truth.channel, random),
            formulation=formulation,
        ),
        dict(zip(case.experiments, (float(each) for each in discharges), strict=True)),
        PROBE * random.standard_normal(perfect.shifts.size),
        named,
    )


def _moved(
    channel: Channel, random: np.random.Generator
) -> tuple[tuple[tuple[float, float], tuple[float, float]], ...]:
    """Patches, each side of which lies up to EDGE off."""
    off = random.uniform(-EDGE, EDGE, (len(channel.patches), 4))
    return tuple(
        ((x[0] + a, x[1] + b), (y[0] + c, y[1] + d))
        for (x, y), (a, b, c, d) in zip(channel.patches, off.tolist(), strict=True)
    )


def true_values(
    site: Site, case: Case, study: str, station: pd.DataFrame, hidden: Mapping[str, Numbers],
    cells: tuple[float, float] | None = None, settled: float = SETTLED, starts: Mapping[str, Flow] | None = None,
) -> Field:  # fmt: skip
    """What error-free instruments would show (station,), with numbers of each hidden effect by its name; cells [m] and
    change at which a flow is steady [m/s2], where not those of the study; starts: flows of a like site by experiment.
    """
    cells = cells or CELLS[study]
    value = np.full(len(station), np.nan)
    for name in case.experiments:
        here = (station["experiment"] == name).to_numpy()
        truth, discharge, level = _hiding(site, case, name, hidden)
        start = {"start": starts[name]} if starts else {}
        flow = steady_flow(truth, discharge, level, cells, settled, **start)
        shifts = np.zeros(len(station))
        shifts[: site.shifts.size] = site.shifts
        value[here] = _readings(truth, flow, level, cells, station[here], shifts[here], hidden)
    return value


def flows_of(site: Site, case: Case, study: str) -> dict[str, Flow]:
    """The steady flow of each experiment where nothing is hidden."""
    told = {name: _hiding(site, case, name, {}) for name in case.experiments}
    return {name: steady_flow(*each, CELLS[study], SETTLED) for name, each in told.items()}


def _hiding(site: Site, case: Case, experiment: str, hidden: Mapping[str, Numbers]) -> tuple[Truth, float, float]:
    """Truth, discharge and level at the outlet of an experiment with what is hidden."""
    truth, setting = site.truth, case.experiments[experiment]
    discharge = float(next(iter(setting.discharge.values()))) * site.discharges[experiment]
    level, spread = float(setting.level), dict[str, float]()
    settings, acting = dict(truth.settings), dict(truth.effects)
    for label, numbers in hidden.items():
        name, where = label.partition("[")[0], label.partition("[")[2].rstrip("]")
        if name == "discharge_error" and where == experiment:
            discharge *= 1.0 + numbers["relative_error"]
        elif name == "outlet_level_error" and where == experiment:
            level += numbers["rise"]
        elif name in ("inflow_skew", "inflow_core"):
            spread |= numbers
        elif name == "inflow_peak":
            spread |= {f"peak_{key}": number for key, number in numbers.items()}
        elif name == "inflow_distribution":
            first = round(numbers.get("mode", 1.0))
            others = [k for k in range(1, 5) if k != first]
            spread[f"mode_{first}"] = numbers["excess"]
            for key, k in zip(("first_other", "second_other", "third_other"), others, strict=True):
                spread[f"mode_{k}"] = numbers.get(key, 0.0)
        elif name == "lateral_inflow":
            half = truth.channel.half
            settings["lateral"] = (0.0, truth.channel.length, -half, half, numbers["share"] * discharge)
        elif name in KNOWN_TO_THE_FLOW:
            acting[name] = numbers
        elif name not in SENSORS and name not in ("discharge_error", "outlet_level_error"):
            raise ValueError(f"{label}: the second solver has no such effect")
    return replace(truth, settings=settings, effects=acting, spread=spread), discharge, level


TABLES: tuple[Mapping[str, object], ...] = (
    effects.PLANTS, effects.DRAG, effects.MIXING, effects.STRESS, effects.FORCE, effects.BED, LAW_DRAG, LAW_MIXING,
)  # fmt: skip
KNOWN_TO_THE_FLOW = {name for table in TABLES for name in table}
SENSORS = ("probe_gain", "station_shift", "partial_depth", "among_plants", "gauge_datum", "gauge_head")


def _readings(
    truth: Truth, flow: Flow, level: float, cells: tuple[float, float], station: pd.DataFrame, shifts: Field,
    hidden: Mapping[str, Numbers],
) -> Field:  # fmt: skip
    """Velocities and levels at stations of one experiment, by instruments that may be off."""
    reach = reach_of(truth, cells, level)
    acting = reach.closure(flow)
    x, y = station["x"].to_numpy(float), station["y"].to_numpy(float) + shifts
    section, gauge = station["section"].astype(str).to_numpy(), (station["kind"] == "level").to_numpy()

    def seen(field: Field) -> Field:
        return at(field, cells, level, x, y, truth.channel)

    for label, numbers in hidden.items():
        if label.startswith("station_shift["):
            y = y + numbers["shift"] * (section == label[14:-1])
    u, h = seen(flow.u), seen(flow.h)
    surface = seen(flow.h + reach.z)
    # min(h_d/h, 1) among plants, else 0
    plants = lie_of(truth.planted, x, y).cover * np.minimum(truth.hd / np.maximum(h, 0.01), 1.0)
    for label, numbers in hidden.items():
        if label.startswith("probe_gain["):
            u = u * (1.0 + numbers["gain"] * (section == label[11:-1]))
        elif label == "partial_depth":
            u = u * (1.0 + numbers["excess"] * np.sqrt(seen(acting.drag) * h) / KARMAN * (1.0 - plants))
        elif label == "among_plants":
            u = u * (1.0 + numbers["gain"] * plants)
        elif label == "gauge_datum":
            surface = surface + numbers["shift"]
        elif label == "gauge_head":
            surface = surface + numbers["share"] * u**2 / (2.0 * GRAVITY)
    return np.where(gauge, surface, u)
