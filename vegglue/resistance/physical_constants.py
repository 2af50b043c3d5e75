"""Constants that more than one part of the model needs: of nature, and of the film of water on dry land."""

GRAVITY = 9.81
# Of D-Flow FM, seen in its source, and what meets Delft3D, the engine of Berends et al. (2020), who do not print it.
KARMAN = 0.41
# Share of the film depth that stays on dry land [-], so that the water table runs on below it: 0.1^(5/3), a fiftieth of
# what a whole film would carry.
FILM_ON_LAND = 0.1
