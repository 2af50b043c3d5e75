"""Field inversion: the smoothest field of one term that closes the misfit, and its evidence.

    ln p(r) = ln N(r; 0, C + J J' + s^2 F F'),    a = s^2 F' (C + J J' + s^2 F F')^-1 r

r is the residual at the middle of the prior, J the slopes of the parameters, F how predictions answer to bumps of the
field, and s its standard deviation. Long bumps make a smooth field, short ones a rough one; both, and s, are charged by
the evidence. a are the sizes of the bumps, with their covariance.
Source: Parish and Duraisamy (2016), doi:10.1016/j.jcp.2015.11.012, for the idea; not checked against it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from vegglue.arrays import Array
from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.model_error import (
    CellResponses,
    GaussianBasis,
    cell_responses,
    excluded_terms,
    field_columns,
    gaussian_basis,
)
from vegglue.calibration.noise import covariance_of
from vegglue.calibration.residual_screening import GROUPS
from vegglue.case.channel_geometry import site_scales
from vegglue.engine.interface import Model
from vegglue.flow.local_changes import Term
from vegglue.parallel import in_threads

# Half lengths and half widths of bumps over the half width of the floor [-], from those of the model's own error to a
# trend along the channel. Chosen, not measured.
FIELD_SHAPES = ((0.3, 0.3), (1.2, 0.3), (1.2, 1.2), (5.0, 0.3), (5.0, 1.0), (20.0, 1.0))
# Standard deviations of fields that are tried [-]: of friction; of a bed over the depth; of viscosity over h u*; of
# water that enters over U h/b. Chosen, not measured: in 1 m of water of 0.5 m/s between banks 3 m apart they are 3 to
# 12 cm, 0.005 to 0.04 m2/s and 0.1 to 1 mm/s, with which all studies before that of the measured flumes ran.
FIELD_SIZES: Mapping[Term, tuple[float, ...]] = {
    "friction": (0.1, 0.2, 0.4, 0.8),
    "bed": (0.03, 0.06, 0.12),
    "viscosity": (0.05, 0.1, 0.2, 0.4),
    "inflow": (3e-4, 1e-3, 3e-3),
}


@dataclass(frozen=True)
class FieldHypothesis:
    """A smooth random field of one term.

    Attributes
    ----------
    over : GaussianBasis
        Its basis functions.
    size : float
        Standard deviation [unit of the term].
    log_factor : float
        ln B against none [-].
    """

    term: Term
    over: GaussianBasis
    size: float
    log_factor: float


@dataclass(frozen=True)
class FieldMap:
    """The field (nx, ny) [unit of its term] at cell centres, and its standard error; total: its integral over the grid,
    and standard error [unit of its term times m2].
    """

    value: Array
    error: Array
    total: tuple[float, float]


def field_sizes(model: Model) -> dict[Term, tuple[float, ...]]:
    """FIELD_SIZES in the unit of each term at the site."""
    scales = site_scales(model.case, model.site)
    units: dict[Term, float] = {
        "friction": 1.0,
        "bed": scales.depth,
        "viscosity": scales.of("eddy"),
        "inflow": scales.speed * scales.depth / scales.half_width,
    }
    return {term: tuple(share * units[term] for share in shares) for term, shares in FIELD_SIZES.items()}


def scanned_fields(search: SearchModel, half_width: float) -> tuple[list[FieldHypothesis], CellResponses]:
    """Every field that is tried: each term that is not excluded, with FIELD_SHAPES and FIELD_SIZES.

        ln B = ln N(r; 0, C + s^2 F F') - ln N(r; 0, C)

    F are the columns of the field of standard deviation 1, C the covariance of the residual r free of the prior.

    Parameters
    ----------
    half_width : float
        Of the floor of the channel [m].

    Returns
    -------
    list of FieldHypothesis
        The most evidence first.
    CellResponses
        That they were made of.
    """
    excluded = excluded_terms(search.model.case)
    terms = tuple(term for term in FIELD_SIZES if term not in excluded)
    responses = cell_responses(search.model, search.point, terms)
    whole, residual = free_of_prior(search)
    nothing = log_density_of_residual(whole, residual)
    sizes = field_sizes(search.model)

    def fields_of(term: Term, length: float, width: float) -> list[FieldHypothesis]:
        over = gaussian_basis(responses.grid, length * half_width, width * half_width)
        columns = search.noise.used(field_columns(responses, term, over))
        gram = columns @ columns.T
        gained = [log_density_of_residual(whole + size**2 * gram, residual) for size in sizes[term]]
        return [FieldHypothesis(term, over, size, one - nothing) for size, one in zip(sizes[term], gained, strict=True)]

    found = in_threads(fields_of, [(term, *shape) for term in terms for shape in FIELD_SHAPES])
    return sorted((one for some in found for one in some), key=lambda one: -one.log_factor), responses


def fields_by_evidence(search: SearchModel, half_width: float) -> tuple[list[FieldHypothesis], CellResponses]:
    """The best field of each term; all terms that compete, shapes and sizes are as likely before.

    Parameters
    ----------
    half_width : float
        Of the floor of the channel [m].

    Returns
    -------
    list of FieldHypothesis, CellResponses
        The most evidence first, log_factor that of all fields of the term with their prior [-]; and the responses that
        they were made of.
    """
    fields, responses = scanned_fields(search, half_width)
    found = []
    competing = dict.fromkeys(one.term for one in fields)
    for term in competing:
        of_term = [one for one in fields if one.term == term]
        prior = -np.log(GROUPS * len(competing) * len(of_term))
        total = float(np.logaddexp.reduce([one.log_factor for one in of_term])) + prior
        found.append(replace(of_term[0], log_factor=total))
    return sorted(found, key=lambda one: -one.log_factor), responses


def map_of_field(search: SearchModel, responses: CellResponses, one: FieldHypothesis) -> FieldMap:
    """The likeliest field and how well it is known.

        value = sum_k a_k phi_k,   var = phi' phi - |L^-1 F phi|^2,   L L' = F F' + C + J J'

    Before the data a ~ N(0, 1). The integral is that of phi in its place.

    Parameters
    ----------
    responses : CellResponses
        Of the predictions to the term in each cell.
    """
    whole, residual = free_of_prior(search)
    along, across = one.over.along, one.over.across
    scale = np.sqrt((along**2).sum(axis=0).mean() * (across**2).sum(axis=0).mean())
    columns = search.noise.used(field_columns(responses, one.term, one.over)) * one.size
    factor = scipy.linalg.cho_factor(whole + columns @ columns.T, lower=True)
    shape = (one.over.x.size, one.over.y.size)
    of_bumps = columns.T @ scipy.linalg.cho_solve(factor, residual)
    sizes, areas = of_bumps.reshape(shape), one.over.areas(responses.grid).ravel()
    of_cells = np.einsum("nab,ai,bj->nij", columns.reshape(-1, *shape), along, across, optimize=True)
    white = scipy.linalg.solve_triangular(factor[0], of_cells.reshape(len(columns), -1), lower=True)
    before = (along**2).sum(axis=0)[:, None] * (across**2).sum(axis=0)[None]
    variance = before - (white**2).sum(axis=0).reshape(before.shape)
    seen = scipy.linalg.solve_triangular(factor[0], columns @ areas, lower=True)
    unit, of_total = one.size / scale, max(float(areas @ areas - seen @ seen), 0.0)
    return FieldMap(
        value=unit * (along.T @ sizes @ across),
        error=unit * np.sqrt(np.maximum(variance, 0.0)),
        total=(float(unit * areas @ of_bumps), float(unit * np.sqrt(of_total))),
    )


def free_of_prior(search: SearchModel) -> tuple[Array, Array]:
    """C + J J' and y - f(z) + J z: covariance and residual at the middle of the prior, to first order.

    Returns
    -------
    ndarray (n, n), ndarray (n,)
        Of the used stations [product of their units, and unit of each].
    """
    noise, point = search.noise, search.point
    slope = noise.used(point.slope)
    return covariance_of(noise) + slope @ slope.T, noise.residual(point.prediction) + slope @ point.z


def log_density_of_residual(covariance: Array, residual: Array) -> float:
    """ln N(r; 0, C) = -r' C^-1 r / 2 - ln|C| / 2, up to a constant.

    Parameters
    ----------
    covariance : ndarray (n, n)
        C.
    residual : ndarray (n,)
        r.

    Returns
    -------
    float
        [-]

    Raises
    ------
    LinAlgError
        If C is not positive definite.
    """
    factor, lower = scipy.linalg.cho_factor(covariance, lower=True)
    misfit = float(residual @ scipy.linalg.cho_solve((factor, lower), residual))
    return -0.5 * misfit - float(np.log(np.diag(factor)).sum())
