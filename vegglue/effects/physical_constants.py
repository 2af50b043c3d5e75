"""Constants that more than one part of the model needs: of nature, and of the film of water on dry land."""

# [m/s2], as Berends et al. (2020) and the codes compared with have it.
GRAVITY = 9.81
# Of von Karman [-]: that of D-Flow FM, seen in its source. Delft3D, the engine of Berends et al. (2020), is met better
# with it than with 0.40; they do not print it.
KARMAN = 0.41
# Kinematic viscosity of water [m2/s], at 20 degrees.
WATER_VISCOSITY = 1e-6
# Density of air over that of water [-].
AIR_OVER_WATER = 1.2e-3
# Share of the film depth that stays on dry land [-], so that the water table runs on below it: 0.1^(5/3), a fiftieth of
# what a whole film would carry.
FILM_ON_LAND = 0.1
