"""Why a station or a point is not used: kept in the table of measurements, and printed as it is."""

OUTSIDE = "it is outside the grid"
AT_WALL = "it is nearer to a side wall than the middle of its cell, where the model has no flow"
EXCLUDED = "the diagnosis excludes it"
BELOW_BED = "below the bed"
ABOVE_SURFACE = "above the water surface"
