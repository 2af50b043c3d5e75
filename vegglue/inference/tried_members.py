"""Members that a search for modes begins with: those of an ensemble, or points of the prior on coarse cells."""

from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.case.channel_geometry import cells_across
from vegglue.case.parameter_space import refuse_without_parameters, z_at
from vegglue.case.prior import sample_prior
from vegglue.engine.interface import Model, linearise, predict
from vegglue.engine.model import ever_coarser
from vegglue.results.ensemble import Ensemble

# Grids that fits go through: chosen. With the third the search for modes of the demo takes 24 s of one core, not 31; a
# fourth hardly resolves a section.
MOST_GRIDS = 3
# Cells across the floor of the channel below which a grid is left out: with two of them, two patches beside each other
# had one mode, which way round they lay was no longer told (DECISIONS), with four both were found.
FEWEST_ACROSS = 4.0
# Points of the prior that are tried where there is no ensemble: as many as the best members that starts are chosen
# from. Chosen: on 100 x 12 cells with three experiments they take 1.5 s of a core.
TRIED_POINTS = 64


@dataclass(frozen=True)
class TriedMembers:
    """Members at z (m, p) and what each predicts at the stations (m, station), NaN where it failed."""

    z: Array
    prediction: Array


def members_of(ensemble: Ensemble, model: Model) -> TriedMembers:
    """The members of an ensemble."""
    return TriedMembers(z_at(model.case, ensemble.parameters), ensemble.prediction)


def points_of_prior(model: Model) -> TriedMembers:
    """TRIED_POINTS of the prior, Sobol' points, on the coarsest cells that fits go through.

    Errors: InputError for a case without parameters.
    """
    refuse_without_parameters(model.case)
    coarsest = grids_of(model)[0]
    z = z_at(model.case, sample_prior(model.case.parameters, TRIED_POINTS, model.case.simulate.seed))
    middle = linearise(coarsest, np.zeros(z.shape[1]))
    if middle is None:
        middle = next((one for one in (linearise(coarsest, place) for place in z) if one is not None), None)
    known = np.full((len(z), len(model.station)), np.nan)
    return TriedMembers(z, known if middle is None else predict(coarsest, [middle], z))


def grids_of(model: Model) -> list[Model]:
    """The model on the grids that fits go through, the coarsest first, and its own at last."""
    *coarse, own = ever_coarser(model.case, model.site)[-MOST_GRIDS:]
    places = [*((case, site) for case, site in coarse if cells_across(site) >= FEWEST_ACROSS), own]
    return [replace(model, case=case, site=site) for case, site in places]
