# %% [markdown]
# # Round the loop
#
# Measurements are made of a flow that turns across the floor, which the model does not know. Then the model is
# calibrated to them, says what it misses, and gets it. Start it in the folder of the repository; it takes a minute or
# two.

# %%
from pathlib import Path

import vegglue

WHERE = Path("runs/loop")
WHERE.mkdir(parents=True, exist_ok=True)
config = WHERE / "small.yaml"
config.write_text(
    f"""extends: {Path("configs/twin.yaml").resolve()}
name: small
title: The short channel on larger cells
grid: {{x: [0, 32], y: [-3.75, 3.75], cell: [1.0, 0.375]}}
simulate: {{members: 64, seed: 1}}
""",
    encoding="utf-8",
)
truth = vegglue.load_case(config)
case = vegglue.make_twin(truth, WHERE / "twin", hide=["secondary_current"], snr=15.0, seed=3)
print(case)

# %% [markdown]
# ## Calibrate
#
# Weighing the members as they are (`glue`) is quick. The default, `refine`, draws around the best of them by more runs.

# %%
ensemble = vegglue.simulate(case, runs=WHERE)
print(ensemble)
posterior = vegglue.infer(case, ensemble, runs=WHERE, method="glue")
print(posterior)

# %% [markdown]
# ## What is missing?

# %%
diagnosis = vegglue.diagnose(case, runs=WHERE, watch=print)
print(diagnosis)

# %% [markdown]
# ## Add it, and see the errors fall

# %%
child = vegglue.extend(case, ["secondary_current"])
comparison = vegglue.compare([case, child], runs=WHERE)
print(comparison)

# %%
for question in vegglue.next_measurement(case, runs=WHERE):
    print(question)

# %% [markdown]
# ## Was it right?

# %%
for line in vegglue.reveal(WHERE / "twin", runs=WHERE):
    print(line)
