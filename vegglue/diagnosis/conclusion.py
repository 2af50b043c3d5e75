"""What a diagnosis concludes from its first and its last screening: the verdict, the misfit by zone, all numbers."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import Baseline, log_evidence
from vegglue.calibration.fingerprints import least_depth
from vegglue.calibration.fit import chance_of_misfit, chi2, fit, freedom_of_misfit, interval95
from vegglue.calibration.law_screening import LawScreening
from vegglue.calibration.learned_bed import bed_of_spots, learned_bed
from vegglue.calibration.noise import Noise, covariance_of_data, with_correlation, with_unknown_errors
from vegglue.calibration.residual_screening import Screening
from vegglue.calibration.score_test import kind_named
from vegglue.case.bed import read_bed_survey
from vegglue.case.case_effects import effect_of
from vegglue.case.channel_geometry import channel_geometry, half_width, site_scales
from vegglue.case.grid import centreline_in, on_map
from vegglue.case.gridded_site import cells_at
from vegglue.case.schema import Case
from vegglue.decision_constants import constants
from vegglue.diagnosis.candidate_effects import (
    candidate_effects_of,
    candidate_laws,
    furthest_off_prior,
    laws_beside,
    not_excluded,
)
from vegglue.diagnosis.child_config import candidate_at
from vegglue.diagnosis.comparison import HeldOutErrors, held_out_errors, largest_error_between
from vegglue.diagnosis.field_scan import fields_by_evidence, free_of_prior, log_density_of_residual, map_of_field
from vegglue.diagnosis.handbook import parameter_doubts
from vegglue.diagnosis.law_search import laws_beside_accepted
from vegglue.diagnosis.odds import tempering
from vegglue.diagnosis.place_search import cannot_be, possible_change
from vegglue.diagnosis.search_state import SearchState, rivals_in
from vegglue.diagnosis.verdict_rules import Doubts, VerdictInputs, make_verdict
from vegglue.effects.definition import Stage
from vegglue.effects.identity import EffectIdentity
from vegglue.engine.interface import Model, Point, flow_at_centres
from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.measurements.kinds import STREAMWISE, kind_of, velocity_rows
from vegglue.measurements.section_discharge import mismatched_discharges
from vegglue.normal_range import NORMAL95
from vegglue.parallel import submit
from vegglue.progress import Watch
from vegglue.results.causes import (
    TERMS_AT_PLACES,
    CandidateEffect,
    FieldFound,
    FieldMapKept,
    LocalAnomaly,
    ModelErrorUsed,
    PlaceMap,
    Rival,
)
from vegglue.results.diagnosis import Diagnosis, FirstScreening, Misfit, ParameterEstimates, Predictions
from vegglue.results.verdict import (
    BedCorrected,
    CellsTooCoarse,
    EstimatedErrors,
    InflowDevelops,
    MeasuredStretch,
    NameHangsOnSection,
    Note,
    OneSection,
    PlacesOnMap,
    ShearLayer,
    TooShallow,
)
from vegglue.version import VERSION

# Distance [m], in units of the half width of the floor, within which a station counts as at the edge of a patch.
AT_EDGE = 0.2


def misfit_zones(model: Model, noise: Noise, point: Point, excluded: Sequence[int] = ()) -> pd.DataFrame:
    """Misfit of all used stations but the excluded ones, by experiment, section and zone.

        mean r,   (1' C 1)^(1/2) / n,   chi2 = sum (r / sigma)^2

    C is the covariance of the data, sigma their standard errors.

    Parameters
    ----------
    point : Point
        At which r = y - f is taken.
    excluded : sequence of int
        Indices among the used stations.

    Returns
    -------
    DataFrame
        experiment, section, zone, stations, mean and standard_error [unit of the station], chi2 [-]. Zones are floor,
        bank, plants and edge; `floor (v)` and the like of velocities across and of speeds; the kind of other
        measurements. Gauges are one section; a discharge may have a section of its own.
    """
    used = model.station.iloc[noise.rows]
    kinds, sections, zones = [kind_of(str(name)) for name in used["kind"]], [], []
    cells = zip(*cells_at(model.site, used["x"].to_numpy(float), used["y"].to_numpy(float)), strict=True)
    for experiment, section, kind, (i, j) in zip(used["experiment"], used["section"], kinds, cells, strict=True):
        gauge = "gauges" if kind.instrument == "gauge" else str(section) or "discharges"
        sections.append(str(section) if kind.velocity else gauge)
        if not kind.velocity:
            zones.append(kind.name)
            continue
        ground = channel_geometry(model.case, model.site, str(experiment))
        if abs(ground.edge[i, j, 0]) < AT_EDGE * ground.half_width[i, j, 0]:
            zone = "edge"
        elif ground.planted[i, j, 0] >= 0.5:
            zone = "plants"
        else:
            zone = "bank" if ground.bank[i, j, 0] else "floor"
        zones.append(zone if kind.name == STREAMWISE else f"{zone} ({kind.column})")
    table = pd.DataFrame({
        "experiment": used["experiment"].to_numpy(), "section": sections, "zone": zones,
        "left": noise.residual(point.prediction), "error": noise.data_error,
    }).drop(index=list(excluded))  # fmt: skip
    rows = []
    covariance = covariance_of_data(noise)
    for (experiment, section, zone), part in table.groupby(["experiment", "section", "zone"], sort=False):
        size, here = len(part), part.index.to_numpy()
        rows.append(
            {
                "experiment": experiment,
                "section": section,
                "zone": zone,
                "stations": size,
                "mean": float(part["left"].mean()),
                "standard_error": float(np.sqrt(covariance[np.ix_(here, here)].sum()) / size),
                "chi2": float(((part["left"] / part["error"]) ** 2).sum()),
            }
        )
    return pd.DataFrame(rows)


# Effects whose likeness is kept, the strongest of the first screening.
COMPARED = 12
# Corrections of a surveyed bed that are reported, and beds that are drawn for the error of their places.
BED_CORRECTIONS, BEDS_DRAWN = 3, 1000
# Hypotheses that a verdict names if none leads.
UNDECIDED_NAMED = 3
# Share of the channel below which velocities come from a small part of it. Chosen, not measured.
SMALL_PART = 0.5
# Stages whose effects may change from place to place along the channel; others act at an end, or in what is read.
ALONG_THE_CHANNEL: tuple[Stage, ...] = ("plants", "resistance", "exchange", "force")
# Length over which a turbulent profile over the depth develops behind an inflow [depths]: 76 - 1e-4 Re/Fr, Kirkgoz and
# Ardiclioglu (1997), doi:10.1061/(ASCE)0733-9429(1997)123:12(1099); not checked against it.
DEVELOPMENT = 76.0
# Depth over that beside it [-] from which water of two speeds meets, as over a floodplain beside its channel. Chosen.
TWO_DEPTHS = 2.0
# Shares of the allowed model error of which the likelihood is computed [-].
ERROR_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0)


def assemble_diagnosis(
    first: Screening,
    last: Screening,
    found: SearchState,
    effects: Mapping[str, CandidateEffect],
    held_out: Model | None,
    laws_beside_first: Callable[[], LawScreening | None],
    watch: Watch,
) -> Diagnosis:
    """The diagnosis of what a search has found, with its verdict and all numbers.

    Parameters
    ----------
    effects : mapping of CandidateEffect
        Every candidate by its name.
    held_out : Model or None
        The model at measurements that no calibration uses.
    laws_beside_first : callable
        `laws_beside` the first screening.
    watch : callable
        Is called with each phase.
    """
    refitted, measured_bed = partial(laws_beside_accepted, watch=watch), submit(_measured_bed, last, found)
    laws = candidate_laws(first, last, found, laws_beside_first, partial(laws_beside, last), refitted)
    if found.places and not found.steps and not found.instruments and laws is not None and laws.clear:
        # What competed after the place did so in the flow with it.
        found = replace(found, places=(), prior_weights=(), of_shape=0.0, undecided=None)
        last, effects = first, candidate_effects_of(first)
        measured_bed = submit(_measured_bed, last, found)
    found = replace(found, places=tuple(as_calibrated(one, last.base) for one in found.places))
    base, before = last.base, first.base
    ranked = tuple(sorted(effects.values(), key=lambda one: (not one.amplitude.refitted, -(one.test.score**2))))
    misfit, errors = misfit_of(first, last, found.flagged), estimated_errors(last, found)
    model_error = _model_error(last)
    likely = laws is not None and laws.likelier and not found.accepted
    field, field_map = (None, None) if likely else explaining_field(first, last, found, misfit)
    undecided = () if found.undecided is None else rivals_in(found.undecided)
    doubts, beside = doubts_of(first, last, found, held_out), significant_effects(last, found)
    bed_map, of_bed = measured_bed()
    verdict = make_verdict(
        VerdictInputs(
            candidates=ranked,
            errors=errors,
            misfit=misfit.size,
            doubts=doubts,
            steps=found.steps,
            places=found.places,
            instruments=found.instruments,
            undecided=undecided,
            implausible=found.implausible,
            field=field,
            laws=laws,
            model_error=model_error,
            not_excluded=() if found.implausible else not_excluded(last),
            significant_effects=beside,
            remainder=bool(beside) and not significant_effects(last, found, found.slack),
            surroundings=surroundings_of(last, found, undecided),
            excluded=base.model.case.exclude or {},
            bed=of_bed,
        )
    )
    strongest = first.ranking[:COMPARED]
    columns = [first.best_column(j) for j in strongest]
    # Scores of the term of the first place that was found, else of drag, before anything was accepted.
    term = found.places[0].term if found.places and found.places[0].term != "barrier" else "drag"
    spots = next(one for one in first.fingerprints.places if one.term == term)
    return Diagnosis(
        name=before.model.case.name,
        version=VERSION,
        verdict=verdict,
        candidate_effects=ranked,
        steps=found.steps,
        misfit=misfit,
        errors=errors,
        first_screening=FirstScreening(
            threshold=first.effects.threshold(constants().effect_alarm_rate),
            scores={one.name: first.best_score(j) for j, one in enumerate(first.fingerprints.candidates)},
            compared=tuple(first.fingerprints.candidates[j].name for j in strongest),
            cosine=score_test.cosines(first.projected)[np.ix_(columns, columns)],
        ),
        parameters=ParameterEstimates(
            {name: interval95(before.model, before.fitted, name)[0] for name in before.model.names},
            {name: interval95(base.model, base.fitted, name) for name in base.model.names},
        ),
        predictions=Predictions(
            station=before.model.station,
            first=before.fitted.point.prediction,
            last=base.fitted.point.prediction,
            error=base.noise.among_all(base.noise.data_error, len(base.model.station)),
        ),
        place_map=PlaceMap(term, spots.x, spots.y, kind_named(first.kinds, term).scores),
        places=found.places,
        instruments=found.instruments,
        field=field,
        model_error=model_error,
        field_map=field_map,
        bed_map=bed_map,
        laws=laws,
    )


def _measured_bed(last: Screening, found: SearchState) -> tuple[FieldMapKept | None, tuple[BedCorrected, ...]]:
    """`bed_of_measurements`, none beside values that no flow can have."""
    return (None, ()) if found.implausible else bed_of_measurements(last)


def bed_of_measurements(last: Screening) -> tuple[FieldMapKept | None, tuple[BedCorrected, ...]]:
    """The correction of a surveyed bed as a map, and where it is clear and large.

    Clear: evidence of field_odds for a mean error over a spot; large: 95 % of its chance lies beyond least_bed_error
    times the mean depth. Of these spots goes first which has the most evidence for a local error beside all that the
    survey leaves open: the smooth correction alone lies where the flow was measured.

    Parameters
    ----------
    last : Screening
        Of the last model.

    Returns
    -------
    FieldMapKept or None
        Correction and standard error [m]; None without a bed that is learned.
    tuple of BedCorrected
        One spot between two lines at most, and BED_CORRECTIONS in all.
    """
    base = last.base
    learned, of_bed = learned_bed(base), [one for one in last.fingerprints.places if one.term == "bed"]
    if learned is None:
        return None, ()
    kept = FieldMapKept(learned.grid.x, learned.grid.y, learned.correction, learned.error)
    surveys = [one.survey for one in base.model.case.bed if one.survey is not None]
    points = [read_bed_survey(one.file) for one in surveys]
    lines = sorted(float(one.points[rows, 0].mean()) for one in points for rows in one.lines)
    least = constants().least_bed_error * site_scales(base.model.case, base.model.site).mean_depth
    random, found = np.random.default_rng(1), list[BedCorrected]()
    for places in of_bed:
        kind = kind_named(last.kinds, places.term)
        local = score_test.log_factors(kind.scores, kind.size)
        of_spots = bed_of_spots(learned, places.x, places.y, places.length, places.width)
        half = NORMAL95 * of_spots.error
        told = (of_spots.log_factor > np.log(constants().field_odds)) & (np.abs(of_spots.mean) - half > least)
        for low, high in itertools.pairwise([-np.inf, *lines, np.inf]):
            within = (places.x >= low) & (places.x < high)
            if not (within & told).any():
                continue
            best = int(np.argmax(np.where(within & told, local, -np.inf)))
            # Where an error of this sign and size is largest, in draws of the bed.
            alike = np.flatnonzero(within & (places.length == places.length[best]))
            drawn = of_spots.columns[alike] @ random.standard_normal((of_spots.columns.shape[1], BEDS_DRAWN))
            signed = np.sign(of_spots.mean[best]) * (of_spots.mean[alike, None] + drawn)
            most = alike[signed.argmax(axis=0)]
            change = float(of_spots.mean[best])
            errors = [float(np.sqrt(np.mean((one[most] - one[best]) ** 2))) for one in (places.x, places.y)]
            found.append(
                BedCorrected(
                    **places.shapes(best),
                    x_error=errors[0],
                    y_error=errors[1],
                    change=change,
                    interval95=(change - float(half[best]), change + float(half[best])),
                    log_factor=float(of_spots.log_factor[best]),
                    local_log_factor=float(local[best]),
                    between=(low, high) if np.isfinite([low, high]).all() else (float("nan"), float("nan")),
                )
            )
    return kept, tuple(sorted(found, key=lambda one: -one.local_log_factor)[:BED_CORRECTIONS])


def doubts_of(first: Screening, last: Screening, found: SearchState, held_out: Model | None) -> Doubts:
    """What may take a name or silence from the verdict on what was found.

    Parameters
    ----------
    held_out : Model or None
        The model at measurements that no calibration uses. These and the errors between the sections are asked only if
        nothing was found: whether silence is earned.
    """
    base, model = last.base, last.base.model
    carried = submit(mismatched_discharges, model.case, model.site, model.station)
    strained, far = furthest_off_prior(model, base.fitted.point.z)
    rows, silent = single_readings(base.noise, found), not (found.steps or found.places or found.undecided)
    errors = HeldOutErrors(float("nan"), 1.0)
    if silent and held_out is not None:
        errors = held_out_errors(base, held_out)
    return Doubts(
        held_out=errors.ratio,
        by_chance=errors.by_chance,
        between=largest_error_between(base) if silent else 1.0,
        neighbours=any(0.0 < base.noise.separation[a, b] < constants().neighbours_within for a in rows for b in rows),
        strained=(strained, far),
        strained_without=strained_without_a_section(base, strained) if far > constants().far_off_prior else None,
        hangs_on=name_without_a_section(first, found),
        one_section=only_section(model.station.iloc[base.noise.rows]),
        carried=tuple(carried()),
    )


def surroundings_of(last: Screening, found: SearchState, undecided: Sequence[Rival]) -> tuple[Note, ...]:
    """Notes on the map, the measured stretch, the parameters, the inflow, the cells and the depth.

    Parameters
    ----------
    undecided : sequence of Rival
        Hypotheses of which none leads.
    """
    base, model = last.base, last.base.model
    bare = not any(one.x.size for one in last.fingerprints.places)
    return (
        *mapped_places(model.case, named_places(found.places, undecided)),
        *measured_stretch(model.case, model.station),
        *parameter_doubts(base),
        *inflow_develops(model, found.effects),
        *cells_too_coarse(base.noise, model.station),
        *shear_layers(model, base.fitted.point, found.places),
        *((TooShallow(least_depth(model)),) if bare else ()),
    )


def single_readings(noise: Noise, found: SearchState) -> list[int]:
    """Single readings that are excluded.

    Returns
    -------
    list of int
        Their indices among the used stations.
    """
    stations = [one.stations[0] for one in found.instruments if len(one.stations) == 1]
    return [int(np.flatnonzero(noise.rows == station)[0]) for station in stations]


def name_without_a_section(first: Screening, found: SearchState) -> NameHangsOnSection | None:
    """The section without which another listed effect leads the accepted one most clearly, to first order.

        (E_best - E_own) / w(E_own) > ln odds

    Odds are same_kind_odds for few_sections, strong_odds for more. Scores and evidence are those of the first screening
    without the rows of the section.

    Returns
    -------
    NameHangsOnSection or None
        None if there is no such section, if no effect was accepted first or a place beside it, or if another effect
        leads with all sections, too: then refits have decided, not first order. A section counts once for each
        experiment, and only if the others hold fingerprint_elsewhere of the squared fingerprint: what acts in one
        section alone cannot be seen without it.
    """
    base, prints = first.base, first.fingerprints
    used = base.model.station.iloc[base.noise.rows]
    section_of = used.groupby(["experiment", "section"], sort=False).ngroup().to_numpy()
    sections = np.unique(section_of[velocity_rows(used)])
    names = [one.name for one in prints.candidates]
    if not found.steps or found.places or sections.size < 2:
        return None
    step = found.steps[0]
    together = {name for group in step.groups if step.accepted in group for name in group} | set(step.rivals)
    if step.accepted not in names:
        return None
    covariance = base.noise.lower @ base.noise.lower.T
    point, plausible = base.fitted.point, np.array([one.plausible_gain for one in prints.amplitudes])
    columns = base.noise.used(point.slope), base.noise.used(prints.values)
    residual = base.noise.residual(point.prediction)
    own_column = first.best_column(names.index(step.accepted))

    def leading(kept: Array) -> tuple[str, float, float]:
        """The effect with most evidence of some rows, the ln odds by which it leads the accepted one, and the squared
        length of the fingerprint of the latter.
        """
        noise = replace(base.noise, lower=np.asarray(np.linalg.cholesky(covariance[np.ix_(kept, kept)]), float))
        slope, changes, left = (noise.whiten(part[kept]) for part in (*columns, residual))
        projected = score_test.project(slope, left, point.z, changes)
        scores = score_test.scores(projected, prints.only_sign)
        evidence = score_test.log_factors(scores, plausible * projected.length)
        of_each = np.array([float(evidence[some].max()) for some in prints.columns])
        best, own = int(np.argmax(of_each)), max(float(of_each[names.index(one)]) for one in together if one in names)
        ahead = (float(of_each[best]) - own) / float(tempering(np.array(own)))
        return names[best], ahead, float(projected.length[own_column]) ** 2

    name, _, whole = leading(section_of >= 0)
    if name not in together:
        return None
    few = sections.size <= constants().few_sections
    least = np.log(constants().same_kind_odds if few else constants().strong_odds)
    clearest = None
    for section in sections:
        name, ahead, left = leading(section_of != section)
        if name not in together and ahead > least and left > constants().fingerprint_elsewhere * whole:
            told = str(used["section"].to_numpy()[section_of == section][0])
            least, clearest = ahead, NameHangsOnSection(step.accepted, told, name)
    return clearest


def only_section(used: pd.DataFrame) -> OneSection | None:
    """The section of all velocities, if there is but one of one experiment, and nothing else is measured.

    Parameters
    ----------
    used : DataFrame
        Stations.

    Returns
    -------
    OneSection or None
    """
    places = used[["experiment", "section"]].drop_duplicates()
    lone = len(places) == 1 and bool(velocity_rows(used).any())
    return OneSection(str(places["section"].iloc[0])) if lone else None


def strained_without_a_section(base: Baseline, parameter: str) -> tuple[str, float] | None:
    """The section without which a parameter lies nearer to the middle of its prior than far_off_prior.

    Calibrated again without the velocities of the section that moves it there most, to first order.

    Returns
    -------
    (str, float) or None
        Section, and |z| of the parameter without it [standard deviations of its prior]; None without one.
    """
    noise, point = base.noise, base.fitted.point
    used, own = base.model.station.iloc[noise.rows], base.model.names.index(parameter)
    of_velocity = velocity_rows(used)
    slope, residual = noise.used(point.slope), noise.residual(point.prediction)
    left: dict[str, tuple[float, Noise]] = {}
    for section in dict.fromkeys(used["section"][of_velocity]):
        of_section = np.flatnonzero(of_velocity & (used["section"] == section).to_numpy())
        less = with_unknown_errors(noise, np.eye(noise.rows.size)[:, of_section])
        white, rest = less.whiten(slope), less.whiten(residual)
        z = point.z + np.linalg.solve(white.T @ white + np.eye(point.z.size), white.T @ rest - point.z)
        left[str(section)] = abs(float(z[own])), less
    if len(left) < 2:
        return None
    section = min(left, key=lambda name: left[name][0])
    far = abs(float(fit(base.model, left[section][1], point).point.z[own]))
    return (section, far) if far < constants().far_off_prior else None


def as_calibrated(place: LocalAnomaly, base: Baseline) -> LocalAnomaly:
    """A place with its amplitude in the last model, in which what was accepted after it is calibrated, too.

    Parameters
    ----------
    place : LocalAnomaly
        Of the model.
    base : Baseline
        The last model.

    Returns
    -------
    LocalAnomaly
        With amplitude and 95 % interval of `base`. With an outline, which that model holds fixed, the interval keeps
        its width over the amplitude.
    """
    parameter = candidate_at(base.model.case, place).parameter
    value, low, high = interval95(base.model, base.fitted, parameter)
    if place.outline is not None:
        low, high = (value * end / place.amplitude for end in place.interval95)
    return replace(place, amplitude=value, interval95=(low, high))


def named_places(places: Sequence[LocalAnomaly], undecided: Sequence[Rival]) -> list[tuple[float, float]]:
    """x, y [m] of what the verdict names at places outside the list."""
    rivals = [one for one in undecided[:UNDECIDED_NAMED] if one.kind in TERMS_AT_PLACES]
    return [(one.x, one.y) for one in places or rivals]


def mapped_places(case: Case, places: Sequence[tuple[float, float]]) -> Iterator[PlacesOnMap]:
    """Where places along and across the channel lie on the map.

    Parameters
    ----------
    places : sequence of (float, float)
        x, y [m].

    Yields
    ------
    PlacesOnMap
        x, y, east and north of each [m]; nothing if there are no places or the case knows no map.
    """
    line, frame = centreline_in(case), case.frame
    if not places or (line is None and frame is None):
        return
    x, y = np.array(places).T
    east, north = (x, y) if line is None else on_map(line, x, y)
    if frame is not None:
        east, north = frame.to_map(east, north)
    yield PlacesOnMap(tuple((*one, float(e), float(n)) for one, e, n in zip(places, east, north, strict=True)))


def measured_stretch(case: Case, station: pd.DataFrame) -> Iterator[MeasuredStretch]:
    """The stretch with velocities, if it is less than SMALL_PART of the channel and effects of the case act along it.

    An effect is one law for the whole channel, and velocities only show it where they are.

    Parameters
    ----------
    station : DataFrame
        All stations.

    Yields
    ------
    MeasuredStretch
        Ends of the stretch and length of the grid [m], and the effects.
    """
    effects = [effect_of(case, name) for name in case.effects]
    law = [one for one in effects if one.stage in ALONG_THE_CHANNEL and "search" not in one.tags]
    along = tuple(dict.fromkeys(one.name for one in law))
    used = station["x"][velocity_rows(station) & station["used"].to_numpy()]
    whole = case.grid.x[1] - case.grid.x[0]
    if along and not used.empty and used.max() - used.min() < SMALL_PART * whole:
        yield MeasuredStretch(float(used.min()), float(used.max()), float(whole), along)


def inflow_develops(model: Model, accepted: Sequence[str]) -> Iterator[InflowDevelops]:
    """Accepted faults of the probes of a section within DEVELOPMENT depths of the beginning of the grid."""
    station, depth = model.station[velocity_rows(model.station)], site_scales(model.case, model.site).depth
    for name in accepted:
        identity = EffectIdentity.parse(name)
        there = station["x"][station["section"].isin(identity.target)]
        if identity.name == "probe_gain" and not there.empty:
            distance = float(there.mean()) - model.case.grid.x[0]
            if distance < DEVELOPMENT * depth:
                yield InflowDevelops(name, distance, distance / depth, DEVELOPMENT)


def cells_too_coarse(noise: Noise, station: pd.DataFrame) -> Iterator[CellsTooCoarse]:
    """Cells whose error in velocities is larger than that of the readings: what is named may be theirs."""
    velocity = velocity_rows(station.iloc[noise.rows])
    of_cells, of_readings = (root_mean_square(one[velocity]) for one in (noise.grid_error, noise.data_error))
    if of_cells > of_readings:
        yield CellsTooCoarse(of_cells, of_readings)


def shear_layers(model: Model, point: Point, places: Sequence[LocalAnomaly]) -> Iterator[ShearLayer]:
    """Places of more mixing across which the depth of the water changes by a factor of TWO_DEPTHS.

    Parameters
    ----------
    point : Point
        Whose flows hold the depth; at each place the experiment with the deepest water counts.

    Yields
    ------
    ShearLayer
        x, y, least and largest depth within the half width of the place, or a cell [m]; dry cells do not count.
    """
    y, least = model.site.grid.y, least_depth(model)
    for one in (each for each in places if each.term == "viscosity" and each.amplitude > 0.0):
        column = cells_at(model.site, np.array([one.x]), np.array([one.y]))[0][0]
        beside = np.abs(y - one.y) <= max(one.width, model.site.grid.dy)
        depths = [flow_at_centres(model, point, name).depth[column, beside] for name in point.flows]
        deepest = max(depths, key=lambda depth: float(depth.max()))
        water = deepest[deepest > least]
        if water.size and water.max() >= TWO_DEPTHS * water.min():
            yield ShearLayer(one.x, one.y, float(water.min()), float(water.max()))


def significant_effects(last: Screening, found: SearchState, slack: float = 0.0) -> dict[str, float]:
    """Effects that are significant in the last model and not in it: P(max_j T_j^2 >= (|T| - slack)^2) < significance.

    Parameters
    ----------
    slack : float
        By how much scores are made smaller first [standard errors].

    Returns
    -------
    dict of float
        Family-wise p by name [-].
    """
    chances = {
        one.name: last.effects.p_of(max(abs(last.best_score(j)) - slack, 0.0))
        for j, one in enumerate(last.fingerprints.candidates)
    }
    return {name: p for name, p in chances.items() if p < constants().significance and name not in found.effects}


def misfit_of(first: Screening, last: Screening, flagged: tuple[int, ...]) -> Misfit:
    """chi2 = |W (y - f)|^2 before and after, and where the first model misses.

    Parameters
    ----------
    flagged : tuple of int
        Excluded readings, indices among the used stations.

    Returns
    -------
    Misfit
        Degrees of freedom and p are those of the last model; the zones those of the first, under the errors of the
        last, whose residual holds the least that is no error.
    """
    before, after = first.base, last.base
    misfit = chi2(after.noise, after.fitted.point)
    unknown = after.noise.unknown
    readings = after.noise.rows.size - (int(np.linalg.matrix_rank(unknown)) if unknown.size else 0)  # numpy before 2.4
    freedom = freedom_of_misfit(readings, after.fitted.covariance)
    # The errors that are reported: those of the last model, whose residual holds the least that is no error.
    errors_as_last = with_correlation(before.noise, after.noise.correlation, after.noise.scale)
    return Misfit(
        chi2_first=chi2(before.noise, before.fitted.point),
        chi2=misfit,
        freedom=freedom,
        p=chance_of_misfit(misfit, freedom),
        zones=misfit_zones(before.model, errors_as_last, before.fitted.point, flagged),
    )


def estimated_errors(screening: Screening, found: SearchState) -> EstimatedErrors:
    """The errors after the last screening; that of the grid is reported for velocities alone [m/s]."""
    noise = screening.base.noise
    flagged = tuple(int(noise.rows[row]) for row in found.flagged)
    velocity = velocity_rows(screening.base.model.station.iloc[noise.rows])
    return EstimatedErrors(noise.correlation, noise.scale, root_mean_square(noise.grid_error[velocity]), flagged)


def _model_error(screening: Screening) -> ModelErrorUsed | None:
    """By how much the model may be wrong, and the share that the residual makes likeliest; None if none is allowed."""
    search, allowed = screening.search, screening.base.model.case.model_error
    noise = search.noise
    if not noise.model_error.any():
        return None
    whole, residual = free_of_prior(search)
    logs = [log_density_of_residual(whole + (share**2 - 1.0) * noise.model_error, residual) for share in ERROR_SHARES]
    best = int(np.argmax(logs))
    gained = float(logs[best] - logs[ERROR_SHARES.index(1.0)])
    return ModelErrorUsed(allowed.friction, allowed.bed, ERROR_SHARES[best], gained)


def explaining_field(
    first: Screening, last: Screening, found: SearchState, misfit: Misfit
) -> tuple[FieldFound, FieldMapKept] | tuple[None, None]:
    """A smooth field of one term and its map, where it explains the misfit of the first model better than all that was
    accepted, or closes a misfit in which nothing was; None where there is nothing to explain, or where a place of the
    same term explains it with fewer numbers. A field that cannot be where it is clearest, or by which more water enters
    than flows, is passed over.
    """
    if found.implausible or (not (found.accepted or found.undecided) and misfit.p >= constants().poor_fit_chance):
        return None, None
    screening = first if found.accepted else last
    search = screening.search
    fields, responses = fields_by_evidence(search, half_width(screening.base.model.site))
    gained = found.gained(log_evidence(first.base), log_evidence(last.base)) if found.accepted else 0.0
    undecided = found.undecided.hypotheses if found.undecided else ()
    gained = max([gained, *(one.log_evidence for one in undecided)])
    told_as_place = {"friction" if place.term in ("drag", "barrier") else place.term for place in found.places}
    for best in fields:
        if not field_goes_first(best.log_factor, gained) or best.term in told_as_place:
            break
        mapped, grid = map_of_field(search, responses, best), responses.grid
        clearest = int(np.argmax(np.abs(mapped.value) / np.maximum(mapped.error, 1e-300)))
        i, j = np.unravel_index(clearest, mapped.value.shape)
        most = FieldFound(
            term=best.term,
            size=best.size,
            length=best.over.length,
            width=best.over.width,
            log_factor=best.log_factor,
            value=float(mapped.value[i, j]),
            error=float(mapped.error[i, j]),
            x=float(grid.x[i]),
            y=float(grid.y[j]),
        )
        # Water that enters is limited as a discharge, by all that enters over the field.
        value, error = mapped.total if best.term == "inflow" else (most.value, most.error)
        half, possible = NORMAL95 * error, possible_change(search.model, search.point, best.term, most.x, most.y)
        if not cannot_be((value - half, value + half), possible):
            return most, FieldMapKept(grid.x, grid.y, mapped.value, mapped.error)
    return None, None


def field_goes_first(log_factor: float, gained: float) -> bool:
    """Whether a smooth field beats nothing, and all that was accepted, by field_odds.

        (E_field - max(E, 0)) / w(E_field) > ln field_odds

    Parameters
    ----------
    log_factor : float
        E_field [-].
    gained : float
        E of all that was accepted [-].
    """
    ahead = (log_factor - max(gained, 0.0)) / tempering(np.array(log_factor))
    return bool(ahead > np.log(constants().field_odds))
