# %% [markdown]
# # Read the results of a run
#
# It needs a run with a posterior, such as the example of docs/own_case.md: `vegglue simulate brook.yaml` and
# `vegglue infer brook.yaml`. Start it in the folder that holds `runs/`.

# %%
import arviz as az
import matplotlib.pyplot as plt
import numpy as np

import vegglue

run = vegglue.load("runs/brook")
print(run)

# %% [markdown]
# ## What the data settle
#
# Draws of equal weight, in blue, before the prior, in grey. Where both are as wide, the data have settled nothing.

# %%
names = list(run.posterior.posterior.data_vars)
print(az.summary(run.posterior, kind="stats"))
figure, axes = plt.subplots(1, len(names), squeeze=False, figsize=(4 * len(names), 3))
for panel, name in zip(axes[0], names, strict=True):
    for group, colour in (("prior", "lightgrey"), ("posterior", "steelblue")):
        panel.hist(run.posterior[group][name].values.ravel(), bins=30, density=True, color=colour)
    panel.set_xlabel(f"{name} [{run.posterior.posterior[name].attrs['units']}]")
if len(names) > 1:
    az.plot_pair(run.posterior, var_names=names)

# %% [markdown]
# ## What is left
#
# Measured minus median prediction, over the errors that the inference has found.

# %%
used = run.stations["used"].to_numpy(bool)
residual, error = run.members.residual.values[used], run.members.noise.values[used]
table = run.stations[used].assign(residual=residual, over_its_error=residual / error)
print(table[["section", "kind", "x", "y", "value", "residual", "over_its_error"]].round(3))
print(f"root mean square residual {np.sqrt(np.mean(residual**2)):.3g} m/s")

# %%
figure, axes = plt.subplots()
for section, rows in table.groupby("section"):
    axes.plot(rows["y"], rows["residual"], "o-", label=f"section {section}")
axes.axhline(0.0, color="grey")
axes.set_xlabel("y [m]")
axes.set_ylabel("measured minus modelled [m/s]")
axes.legend()

# %% [markdown]
# ## What a parameter moves
#
# Over the whole ensemble, solved members only: how much of the first prediction goes along with each parameter.

# %%
first = run.ensemble.prediction.isel(station=0).values
solved = np.isfinite(first)
for name in names:
    together = np.corrcoef(run.ensemble[name].values[solved], first[solved])[0, 1]
    print(f"{name}: correlation {together:+.2f} with the prediction at the first station")
