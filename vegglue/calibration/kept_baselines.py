"""The baselines of a case and of its child, which several steps of a run begin with, each computed once."""

import hashlib
import json
from collections import OrderedDict
from dataclasses import replace

import pandas as pd

from vegglue.calibration.baseline import Baseline, baseline
from vegglue.case.resolved_config import dumped, plain_tree
from vegglue.engine.interface import Model
from vegglue.engine.model import coarser
from vegglue.engine.newton import NEWTON

# A case and its child [-]: each holds factors of all its experiments, each 0.2 GB by its size at 1142 x 40 cells.
MOST_KEPT = 2
# Keys of a case on which no calibration hangs, as pydantic wants those to leave out.
ONLY_NAMED = dict.fromkeys(
    ("name", "title", "simulate", "infer", "survey", "validation", "reference", "canopy_correction"), True
) | {"frame": True, "imported": True}
_kept: OrderedDict[str, Baseline] = OrderedDict()


def kept_baseline(model: Model) -> Baseline:
    """`baseline` of a model from its prior; of the same grid, measurements and priors it is not made again."""
    if model.engine is not NEWTON or model.case.effect_file is not None:  # codes of others, which may have changed
        return baseline(model)
    key = _content_of(model)
    found = _kept.pop(key, None)
    if found is None:
        found = baseline(model)
    else:
        found = replace(found, model=model, coarse=None if found.coarse is None else coarser(model))
    _kept[key] = found
    while len(_kept) > MOST_KEPT:
        _kept.popitem(last=False)
    return found


def _content_of(model: Model) -> str:
    """A digest of what the predictions of a model and its misfit hang on, as it was read."""
    tree = plain_tree(dumped(model.case, ONLY_NAMED), str)
    digest = hashlib.sha256(json.dumps(tree).encode())
    for site in (model.site, *model.site.own.values()):
        for values in (site.bed, site.friction_class, site.patch, site.cover):
            digest.update(values.tobytes())
    digest.update(pd.util.hash_pandas_object(model.station, index=False).to_numpy().tobytes())
    return digest.hexdigest()
