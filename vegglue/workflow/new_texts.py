"""The texts of a new working folder: a case with a comment for each number, and what to do with it."""

# Lines that end in `# plants` are left out where there are none.
CASE = """\
# A case: everything a run depends on. SI units throughout; x downstream, y across to the left, z as surveyed.
name: {name}                     # results go to runs/{name}/
title: A straight reach          # stands above the report
grid:                            # of the model; eight cells across the floor are enough for a first look
  x: [0, {length}]               # from upstream to downstream [m]
  y: [-{half}, {half}]           # across, wide enough that water never reaches the edge [m]
  cell: [{dx}, {dy}]             # a whole number of cells along each [m]
bed:                             # or {{raster: bed.asc}}, {{points: survey.csv}}; later layers win where they have data
  - trapezoid: {{axis: 0, bottom_width: {width}, bank_slope: 0.5, bed_slope: {slope}, level: 0}}
friction:
  classes:
    bed: {{law: manning, n: n_b}}  # a number, or the name of a parameter below
  default: bed
plants:                                                               # plants
  stands:                                                             # plants
    reed: {{phi: phi, canopy_height: {canopy}}}  # drag of the plants [-], their height in the flow [m] # plants
  patches:                                                            # plants
    - {{name: p1, stand: reed, x: [{patch_from}, {patch_to}], y: [0, {patch_side}]}} # plants
inflows:
  upstream: {{side: west}}         # water enters by the west side, spread by depth
experiments:                     # as many as were measured; they share the parameters
  first: {{discharge: {discharge}, level: {level}}}  # [m3/s]; level at the outlet, datum of the bed [m]
parameters:                      # the unknowns and what is known of them before
  n_b: {{distribution: loguniform, low: 0.01, high: 0.1, unit: s m^(-1/3), symbol: n_b, meaning: Manning coefficient}}
  phi: {{distribution: loguniform, low: 0.5, high: 50, unit: '-', symbol: φ, meaning: drag of the plants}} # plants
observations:                    # put your own in place of these, which were computed
  - {{kind: velocity, file: velocities.csv, experiment: first, synthetic: true}}
  - {{kind: level, file: levels.csv, experiment: first, synthetic: true}}
simulate: {{members: 256, seed: 1}}  # a first look; 4096 for a final answer
infer: {{sigma: known}}            # standard errors are those of the files
model_error: {{friction: 0.05, bed: 0.01}}  # by how much the model itself may be wrong [-], [m]
"""

README = """\
# {name}

`case.yaml` describes the reach; `velocities.csv` and `levels.csv` hold measurements that were **computed**, with errors
added, so that everything runs as it is. Put your own in their place: the columns are x, y [m], u [m/s] or level [m],
and their standard errors `u_se` and `level_se`.

    vegglue check case.yaml      # reads everything and says what is odd
    vegglue simulate case.yaml   # solves the ensemble
    vegglue run case.yaml        # the whole loop: what is missing in the model, and a report

Tables of other forms and units, workbooks and instruments' exports go through `vegglue import` instead.
"""
