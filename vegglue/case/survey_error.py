"""The bed between the points of a survey, and how wrong it may be there: universal kriging.

    z = X beta + g + e,   cov g = s^2 M,   e ~ N(0, s_e^2) of each point
    smooth:  M = m(r),   r^2 = (dx / l_x)^2 + (dy / l_y)^2
    rough:   M = exp(-|dx| / l_x) m(|dy| / l_y),   m(r) = (1 + q + q^2 / 3) exp(-q),   q = 5^(1/2) r

X are a slope along the channel and a mean cross-section of B-splines; beta is not known. s, l_y and s_e are those of
the largest restricted likelihood for each l_x. Lines far apart hardly determine l_x and whether the bed is smooth
along: mean and covariance are averages over both by likelihood and prior, ln l_x ~ N(ln(RATIO l_y), LOG_SD^2),
smooth and rough alike. A line i that is left out misses its prediction by (Q_ii)^-1 (Q z)_i with covariance (Q_ii)^-1,
Q = K^-1 - K^-1 X (X' K^-1 X)^-1 X' K^-1, K = s^2 M + s_e^2 I.
Sources: Rasmussen and Williams (2006), Gaussian Processes for Machine Learning, sections 2.7 and 4.2; Dubrule (1983),
doi:10.1007/BF01032975, for what is left out; Harbrecht, Peters and Schneider (2012), doi:10.1016/j.apnum.2011.10.001,
for the square root. Not checked against them; the tests compare with brute force and with drawn fields.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.special import logsumexp, ndtri

from vegglue.arrays import Array
from vegglue.case.site_schema import CovarianceOfBed, LinesLeftOut

# Length along over that across if the survey does not determine it: bars and pools are longer than wide. Chosen.
# The rough alternative and the spread were chosen after river-a, b and d, whose lines of every 12 m meet bars of 23 m.
RATIO, LOG_SD = 2.5, 0.35
# Lengths along that are tried, over RATIO l_y [-], and the least chance of one that is kept.
LENGTHS_TRIED, LEAST_CHANCE = np.geomspace(0.25, 4.0, 9), 0.01
# Fewest and most B-splines of the mean cross-section, and by how many fewer they are than the points of a line: of
# fewer, what the mean leaves is the same on all lines and looks like a great length along.
SPLINES, FEWER = (8, 24), 3
# A smaller survey does not determine its own error; of a larger one the covariance is too much work.
FEWEST_SURVEYED, MOST_SURVEYED, FEWEST_LINES = 40, 1000, 4
# Most points whose likelihood is computed.
MOST_FITTED = 300
# Bounds of l_x and l_y over length and width of the survey [-], and of s_e^2 / s^2 [-].
LENGTHS_OVER_EXTENT, NUGGET = (0.02, 2.0), (1e-6, 10.0)
# Where the search for them begins.
GUESS, NUGGET_GUESS = 0.15, 0.01
# Standard deviation of the level of a line that was levelled wrongly [m]: a staff read wrongly, a benchmark mistaken.
LOOSE_ERROR = 1.0
# Share of surveys in which errors alone make `check` name a line as levelled wrongly. Taken for all lines together
# after river-h, whose wrong line is off by 2.97 standard errors.
WRONG_LINE = 0.05
# Standard errors from which the line that is furthest off does not count in the fit of the covariance. Chosen: one
# survey in two has such a line by errors alone, and hardly changes without it.
OFF_ALL_OTHERS = 2.0
# Eigenvalue over the largest of the precision of offsets below which the survey says nothing of them [-].
LEAST_EIGENVALUE = 1e-9
# Share of the variance that the square root leaves out, and its largest number of columns.
LEFT_OUT, MOST_OF_SQUARE_ROOT = 0.01, 400
# Places of the square root that are taken at once.
PLACES_AT_ONCE = 16
# Places whose correlations and mean are computed at a time.
PLACES_AT_A_TIME = 5000


@dataclass(frozen=True)
class BedSurvey:
    """Points of a survey of the bed.

    Attributes
    ----------
    points
        x along, y across and z (n, 3) [m].
    line
        Number of the line of each (n,), -1 for a point in none.
    loose
        Numbers of lines whose level is not known, as they were levelled wrongly, only their shape.
    """

    points: Array
    line: NDArray[np.int64]
    loose: tuple[int, ...] = ()

    @property
    def lines(self) -> list[NDArray[np.int64]]:
        """Rows of each line, in the order of their places along."""
        rows = [np.flatnonzero(self.line == number) for number in np.unique(self.line[self.line >= 0])]
        return sorted(rows, key=lambda own: float(self.points[own, 0].mean()))

    @property
    def of_lines(self) -> Array:
        """1 where a point is one of a line, else 0 (n, lines)."""
        numbers = np.array([self.line[rows[0]] for rows in self.lines])
        return np.asarray(self.line[:, None] == numbers, dtype=np.float64)

    @property
    def tells_its_error(self) -> bool:
        """Whether there are enough points and lines, and not too many points."""
        enough = FEWEST_SURVEYED <= len(self.points) <= MOST_SURVEYED
        return enough and (len(self.lines) >= FEWEST_LINES if (self.line >= 0).any() else True)

    def basis(self, places: Array) -> Array:
        """X (m, p) [-] at places (m, >= 2) [m]: the slope and B-splines of y, constant beyond the outermost points.

        The splines sum to one, which is the level.
        """
        from scipy.interpolate import BSpline  # late: a case without a survey need not wait for it

        x, y = self.points[:, 0], self.points[:, 1]
        each = len(y) / max(len(self.lines), 1) if (self.line >= 0).any() else np.sqrt(len(y))
        low, high, count = y.min(), y.max(), int(np.clip(round(each) - FEWER, *SPLINES))
        knots = np.r_[[low] * 3, np.linspace(low, high, count - 2), [high] * 3]
        across = BSpline.design_matrix(np.clip(places[:, 1], low, high), knots, 3).toarray()
        return np.column_stack([(places[:, 0] - x.mean()) / max(np.ptp(x), 1e-9), across])


def correlation_of_bed(places: Array, others: Array, along: float, across: float, rough: bool) -> Array:
    """M = m(r), or exp(-|dx| / l_x) m(|dy| / l_y) of a rough bed, (n, m) [-], as in the head of this file.

    Parameters
    ----------
    places, others : (n, >= 2), (m, >= 2) [m]
    along, across : l_x, l_y [m]
    """
    from scipy.spatial.distance import cdist  # late: a case without a survey need not wait for it

    found, axes = np.empty((len(places), len(others))), slice(1 if rough else 0, 2)
    here, there = (each[:, :2] / (along, across) for each in (places, others))
    for first in range(0, len(others), PLACES_AT_A_TIME):
        some = there[first : first + PLACES_AT_A_TIME]
        q = np.sqrt(5.0) * cdist(here[:, axes], some[:, axes])
        fall = q + np.abs(here[:, None, 0] - some[None, :, 0]) if rough else q
        found[:, first : first + PLACES_AT_A_TIME] = (1.0 + q + q**2 / 3.0) * np.exp(-fall)
    return found


def fitted_covariances(survey: BedSurvey) -> list[CovarianceOfBed]:
    """Covariances of the largest restricted likelihood for each l_x, with their chances, which sum to one.

    Parameters
    ----------
    survey : BedSurvey
        Its lines all count as levelled well; of more than MOST_FITTED points those in the middle of the reach count.

    Returns
    -------
    list of CovarianceOfBed
        The least likely ones are left out.
    """
    if len(survey.points) > MOST_FITTED:
        own = {number: survey.points[survey.line == number, 0].mean() for number in np.unique(survey.line)}
        along = np.where(survey.line < 0, survey.points[:, 0], [own[number] for number in survey.line])
        some = np.argsort(np.abs(along - np.median(along)), kind="stable")[:MOST_FITTED]
        survey = BedSurvey(survey.points[some], survey.line[some])
    points, basis = survey.points, survey.basis(survey.points)
    length, width = np.ptp(points[:, 0]), np.ptp(points[:, 1])

    def restricted(rough: bool, along: float, across: float, nugget: float) -> tuple[float, float]:
        """ln of the restricted likelihood with the best s, and that s [m]; nugget: s_e^2 / s^2 [-]."""
        of_readings = correlation_of_bed(points, points, along, across, rough) + nugget * np.eye(len(points))
        lower = cholesky(of_readings, lower=True)
        white = solve_triangular(lower, np.column_stack([basis, points[:, 2]]), lower=True)
        q, r = np.linalg.qr(white[:, :-1])
        left, free = white[:, -1] - q @ (q.T @ white[:, -1]), len(points) - basis.shape[1]
        variance = max(float(left @ left) / free, 1e-12)
        log_determinants = np.log(np.diag(lower)).sum() + np.log(np.abs(np.diag(r))).sum()
        return float(-0.5 * free * np.log(variance) - log_determinants), float(np.sqrt(variance))

    def best(rough: bool, start: Array, *along: float) -> Array:
        """ln of what is not given of (l_x, l_y, nugget) at the largest likelihood."""
        from scipy.optimize import minimize  # late: a case without a survey need not wait for it

        over = np.array(LENGTHS_OVER_EXTENT)
        bounds = np.log(np.array([over * length, over * width, np.array(NUGGET)]))[len(along) :]
        found = minimize(
            lambda at: -restricted(rough, *along, *np.exp(at))[0], start, method="L-BFGS-B", bounds=bounds,
            options={"ftol": 1e-8},
        )  # fmt: skip
        return np.asarray(found.x)

    logs, found = [], []
    for rough in (False, True):
        guess = np.log([RATIO * GUESS * width, GUESS * width, NUGGET_GUESS])
        start = best(rough, guess)[1:]
        for along in RATIO * np.exp(start[0]) * LENGTHS_TRIED:
            start = best(rough, start, along)
            log, sd = restricted(rough, along, *np.exp(start))
            logs.append(log - 0.5 * ((np.log(along / RATIO) - start[0]) / LOG_SD) ** 2)
            found.append((rough, along, *np.exp(start), sd))
    chances = np.exp(np.array(logs) - logsumexp(logs))
    total = chances[chances >= LEAST_CHANCE].sum()
    return [
        CovarianceOfBed(
            chance=float(chance / total),
            rough=rough,
            along=float(f"{along:.4g}"),
            across=float(f"{across:.4g}"),
            sd=float(f"{sd:.4g}"),
            point_error=float(f"{sd * np.sqrt(nugget):.3g}"),
        )
        for chance, (rough, along, across, nugget, sd) in zip(chances, found, strict=True)
        if chance >= LEAST_CHANCE
    ]


def covariances_beside_wrong_line(survey: BedSurvey) -> list[CovarianceOfBed]:
    """`fitted_covariances`, without the line that is furthest off all others, from OFF_ALL_OTHERS standard errors on.

    A line at a wrong level makes the bed look rough: 0.15 m on lines every 4 m stood out by 4 standard errors under its
    own covariance, and by 13 under that of the others. Of 34 surveys without a wrong line one had a line off by more
    than 4.5 in both ways.
    """
    found = fitted_covariances(survey)
    if len(survey.lines) <= FEWEST_LINES:
        return found
    off, error, _ = line_offsets(survey, found)
    between = np.abs(off / error)[1:-1]
    if between.max() < OFF_ALL_OTHERS:
        return found
    others = np.ones(len(survey.points), dtype=bool)
    others[survey.lines[1 + int(between.argmax())]] = False
    return fitted_covariances(BedSurvey(survey.points[others], survey.line[others]))


def left_out(survey: BedSurvey, covariances: Sequence[CovarianceOfBed]) -> tuple[Array, Array]:
    """(Q_ii)^-1 (Q z)_i of each line i: reading less prediction with it left out; of a point in no line, itself.

    Returns
    -------
    error, standard deviation : (n,), (n,) [m]
        Of each point; the latter is that of the reading, with the error of its point.
    """
    z = survey.points[:, 2]
    errors, squares = (np.zeros((len(covariances), len(z))) for _ in range(2))
    for index, one in enumerate(covariances):
        q = _precision_beside_mean(survey, one)
        for rows in [*survey.lines, *np.flatnonzero(survey.line < 0)[:, None]]:
            own = np.linalg.pinv(q[np.ix_(rows, rows)], hermitian=True)
            errors[index, rows], squares[index, rows] = own @ (q[rows] @ z), np.diag(own)
    chance = np.array([one.chance for one in covariances])
    mean = chance @ errors
    return mean, np.sqrt(chance @ (squares + (errors - mean) ** 2))


def lines_left_out(survey: BedSurvey, covariances: Sequence[CovarianceOfBed], straight: Array) -> LinesLeftOut:
    """How well the lines between the outermost, or else all points, are predicted from the others.

    Parameters
    ----------
    survey, covariances
        As `left_out`.
    straight : (n,) [m]
        Level less that of straight lines between the neighbours, with its line left out; NaN for none.
    """
    error, stated = left_out(survey, covariances)
    judged = np.isfinite(straight)
    own = [rows[judged[rows]] for rows in survey.lines] or list(np.flatnonzero(judged)[:, None])
    own = [rows for rows in own if rows.size]
    error_of, stated_of = (np.array([_rms(values[rows]) for rows in own]) for values in (error, stated))
    most = int((error_of / stated_of).argmax())
    off, of_off, _ = line_offsets(survey, covariances)
    between = np.arange(off.size)[1:-1]  # beyond the outermost the bed may go on otherwise
    furthest = int(between[np.abs(off / of_off)[between].argmax()]) if off.size else -1
    rounded = [float(f"{_rms(values[judged]):.4g}") for values in (error, stated, straight)]
    return LinesLeftOut(
        count=len(own), error=rounded[0], stated=rounded[1], straight=rounded[2],
        most=round(float(error_of[most] / stated_of[most]), 3),
        most_at=round(float(survey.points[own[most], 0].mean()), 3),
        offset=float(f"{off[furthest]:.3g}") if off.size else 0.0,
        offset_error=float(f"{of_off[furthest]:.3g}") if off.size else 0.0,
        offset_at=round(float(survey.points[survey.lines[furthest], 0].mean()), 3) if off.size else 0.0,
    )  # fmt: skip


def line_offsets(survey: BedSurvey, covariances: Sequence[CovarianceOfBed]) -> tuple[Array, Array, Array]:
    """d = 1'(Q z)_i / 1' Q_ii 1 and its standard error (1' Q_ii 1)^(-1/2): by how much the whole line i is too high.

    Parameters
    ----------
    survey, covariances
        As `left_out`.

    Returns
    -------
    d, standard error : (lines,), (lines,) [m]
    correlations : (lines, lines) [-]
        Of 1'(Q z)_i.
    """
    z, lines, whole = survey.points[:, 2], survey.lines, survey.of_lines
    off, squares = (np.zeros((len(covariances), len(lines))) for _ in range(2))
    together = np.zeros((len(lines), len(lines)))
    for index, one in enumerate(covariances):
        q = _precision_beside_mean(survey, one)
        weight = whole.T @ q @ whole
        off[index], squares[index] = whole.T @ q @ z / np.diag(weight), 1.0 / np.diag(weight)
        together += one.chance * weight
    chance = np.array([one.chance for one in covariances])
    mean, alone = chance @ off, np.sqrt(np.diag(together))
    return mean, np.sqrt(chance @ (squares + (off - mean) ** 2)), together / np.outer(alone, alone)


def evidence_of_lines(survey: BedSurvey, covariances: Sequence[CovarianceOfBed]) -> tuple[Array, Array]:
    """h = H d + e, e ~ N(0, 1): what the survey says about offsets d [m] of its lines.

        H' H = G,   H' h = g,   g_i = d_i / s_i^2,   G_ij = c_ij / (s_i s_j)

    d_i, s_i and c_ij are those of `line_offsets`. A level and a slope of all lines leave no trace.

    Parameters
    ----------
    survey, covariances
        As `left_out`.

    Returns
    -------
    h, H : (lines,) [-], (lines, lines) [1/m]
    """
    off, error, correlation = line_offsets(survey, covariances)
    values, vectors = np.linalg.eigh(correlation / np.outer(error, error))
    root = np.sqrt(np.where(values > LEAST_EIGENVALUE * values.max(), values, 0.0))
    back = np.divide(1.0, root, out=np.zeros_like(root), where=root > 0.0)
    return back * (vectors.T @ (off / error**2)), root[:, None] * vectors.T


def stands_out(found: LinesLeftOut) -> bool:
    """Whether the line that is furthest off all others is so by errors alone in less than WRONG_LINE of surveys."""
    return abs(found.offset) > found.offset_error * float(ndtri(1.0 - 0.5 * WRONG_LINE / found.count))


def mean_level(
    survey: BedSurvey, covariances: Sequence[CovarianceOfBed], places: Array, levels: Array | None = None
) -> Array:
    """X beta + k' K^-1 (z - X beta): the mean of the bed given a survey, over its covariances (m,) [m].

    Parameters
    ----------
    survey, covariances
        As `left_out`.
    places : (m, 2) [m]
    levels : (n, k) [m], optional
        In place of z; columns (m, k) come back.
    """
    basis = survey.basis(survey.points)
    z = survey.points[:, 2:] if levels is None else levels
    found = np.zeros((len(places), z.shape[1]))
    for one in covariances:
        lower = cholesky(_of_readings(survey, one), lower=True)
        white = solve_triangular(lower, np.column_stack([basis, z]), lower=True)
        shape, white = white[:, : basis.shape[1]], white[:, basis.shape[1] :]
        beta = np.linalg.lstsq(shape, white)[0]
        weights = one.sd**2 * solve_triangular(lower, white - shape @ beta, lower=True, trans="T")
        for part in np.array_split(np.arange(len(places)), len(places) // PLACES_AT_A_TIME + 1) if len(places) else ():
            near = _between(places[part], survey.points, one)
            found[part] += one.chance * (survey.basis(places[part]) @ beta + near @ weights)
    return found[:, 0] if levels is None else found


def line_weights(survey: BedSurvey, covariances: Sequence[CovarianceOfBed], places: Array) -> Array:
    """By how much `mean_level` rises with the level of each line (m, lines) [-].

    Parameters
    ----------
    survey, covariances, places
        As `mean_level`.
    """
    return mean_level(survey, covariances, places, survey.of_lines)


def bed_survey_text(survey: BedSurvey) -> str:
    """The file of `read_bed_survey`."""
    rows = zip(survey.points.tolist(), survey.line.tolist(), strict=True)
    return "x,y,z,line\n" + "".join(f"{x:.4f},{y:.4f},{z:.4f},{line}\n" for (x, y, z), line in rows)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@dataclass(frozen=True)
class _Seen:
    """What a survey says at places (m, 2) [m]: by how much the mean of each covariance is off the weighted one, and
    whitened covariances with its points and with its mean section, for each covariance.
    """

    places: Array
    apart: Array
    parts: list[tuple[Array, Array]]

    def some(self, of: NDArray[np.int64]) -> "_Seen":
        parts = [(near[:, of], of_mean[:, of]) for near, of_mean in self.parts]
        return _Seen(self.places[of], self.apart[:, of], parts)


@dataclass(frozen=True)
class _Kriging:
    """A survey under each covariance: Cholesky's L of K, L^-1 (X, z), Cholesky's root of X' K^-1 X, and beta."""

    survey: BedSurvey
    covariances: Sequence[CovarianceOfBed]
    parts: list[tuple[Array, Array, Array, Array]]

    def seen(self, places: Array) -> _Seen:
        """What the survey says at places (m, 2) [m]."""
        there, chance = self.survey.basis(places), np.array([one.chance for one in self.covariances])
        means, parts = [], []
        for one, (lower, white, shape, beta) in zip(self.covariances, self.parts, strict=True):
            near = solve_triangular(lower, one.sd**2 * _between(self.survey.points, places, one), lower=True)
            of_mean = solve_triangular(shape, there.T - white[:, :-1].T @ near, lower=True)
            means.append(there @ beta + near.T @ (white[:, -1] - white[:, :-1] @ beta))
            parts.append((near, of_mean))
        apart = np.sqrt(chance)[:, None] * (np.array(means) - chance @ np.array(means))
        return _Seen(places, apart, parts)

    def variance(self, at: _Seen) -> Array:
        """(m,) [m2]."""
        found = (at.apart**2).sum(axis=0)
        for one, (near, of_mean) in zip(self.covariances, at.parts, strict=True):
            found += one.chance * (one.sd**2 - (near**2).sum(axis=0) + (of_mean**2).sum(axis=0))
        return np.asarray(found)

    def covariance(self, of: _Seen, others: _Seen) -> Array:
        """(m, count) [m2]."""
        found = of.apart.T @ others.apart
        for one, (near, of_mean), (its_near, its_mean) in zip(self.covariances, of.parts, others.parts, strict=True):
            kernel = one.sd**2 * _between(of.places, others.places, one)
            found += one.chance * (kernel - near.T @ its_near + of_mean.T @ its_mean)
        return np.asarray(found)


def root_of_covariance(survey: BedSurvey, covariances: Sequence[CovarianceOfBed], places: Array) -> Array:
    """B with B B' the covariance of the bed around `mean_level`, but for a share LEFT_OUT of its variance.

    Parameters
    ----------
    survey, covariances, places
        As `mean_level`.

    Returns
    -------
    (m, k) [m]
        k is MOST_OF_SQUARE_ROOT at most.
    """
    basis, parts = survey.basis(survey.points), []
    for one in covariances:
        lower = cholesky(_of_readings(survey, one), lower=True)
        white = solve_triangular(lower, np.column_stack([basis, survey.points[:, 2]]), lower=True)
        shape = cholesky(white[:, :-1].T @ white[:, :-1], lower=True)
        parts.append((lower, white, shape, cho_solve((shape, True), white[:, :-1].T @ white[:, -1])))
    kriging = _Kriging(survey, covariances, parts)
    # Cholesky's square root B by the largest variance left, of several places apart at once: their columns are one
    # product of matrices, which takes a tenth of the time of one by one.
    seen = kriging.seen(places)
    left = np.maximum(kriging.variance(seen), 0.0)
    nearest = 0.5 * min(one.along for one in covariances), 0.5 * min(one.across for one in covariances)
    columns, rank = np.zeros((min(MOST_OF_SQUARE_ROOT, len(places)), len(places))), 0
    enough = LEFT_OUT * left.sum()
    while rank < len(columns) and left.sum() > enough:
        open_, of = left.copy(), list[int]()
        while len(of) < min(PLACES_AT_ONCE, len(columns) - rank) and open_.max() > 0.5 * left.max():
            of.append(int(open_.argmax()))
            open_[(np.abs(places[:, :2] - places[of[-1], :2]) < nearest).all(axis=1)] = 0.0
        rest = kriging.covariance(seen, seen.some(np.array(of))) - columns[:rank].T @ columns[:rank, of]
        columns[rank : rank + len(of)] = solve_triangular(cholesky(rest[of], lower=True), rest.T, lower=True)
        left = np.maximum(left - (columns[rank : rank + len(of)] ** 2).sum(axis=0), 0.0)
        rank += len(of)
    return columns[:rank].T


def _between(places: Array, others: Array, one: CovarianceOfBed) -> Array:
    return correlation_of_bed(places, others, one.along, one.across, one.rough)


def _precision_beside_mean(survey: BedSurvey, one: CovarianceOfBed) -> Array:
    """Q = K^-1 - K^-1 X (X' K^-1 X)^-1 X' K^-1 (n, n) [1/m2].

    LinAlgError if K is singular to rounding, as on an even bed known by many points: 1 / Q_ii are variances.
    """
    basis, inverse = survey.basis(survey.points), np.linalg.inv(_of_readings(survey, one))
    projected = inverse @ basis
    precision = np.asarray(inverse - projected @ np.linalg.solve(basis.T @ projected, projected.T))
    if (np.diag(precision) <= 0.0).any():
        raise np.linalg.LinAlgError("variances below 0")
    return precision


def _of_readings(survey: BedSurvey, one: CovarianceOfBed) -> Array:
    """K = s^2 M + s_e^2 I + LOOSE_ERROR^2 sum 1_i 1_i' over loose lines i (n, n) [m2]."""
    points = survey.points
    found = one.sd**2 * _between(points, points, one) + one.point_error**2 * np.eye(len(points))
    for number in survey.loose:
        own = (survey.line == number).astype(float)
        found += LOOSE_ERROR**2 * np.outer(own, own)
    return found
