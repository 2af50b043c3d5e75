"""Constants of nature that more than one part of the model needs."""

GRAVITY = 9.81
# Of D-Flow FM, seen in its source, and what meets Delft3D, the engine of Berends et al. (2020), who do not print it.
KARMAN = 0.41
