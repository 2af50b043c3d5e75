"""Effects on the friction rate k = g / (C^2 h) [1/m] beyond the laws of the classes."""

from vegglue.effect import Amplitude, Array, Cells, Effect, Shape


def depth_dependent_bank(cells: Cells, exponent: Array, reference_depth: Array) -> dict[str, Array]:
    """k -> k (h / h_0)^e on the banks."""
    depth = cells.depth.clip(0.02)
    return {"rate": cells.rate * (depth / reference_depth) ** (exponent * cells.ground.bank)}


EFFECTS = (
    Effect(
        name="depth_dependent_bank",
        stage="resistance",
        title="Banks grow rougher or smoother with depth than their law says",
        equation="k -> k (h / h_0)^e on the banks, h at least 0.02 m",
        act=depth_dependent_bank,
        amplitude=Amplitude("exponent", "-", "exponent e", 0.5, -3.0, 3.0),
        shapes=(Shape("reference_depth", "m", "depth h_0 at which nothing changes", 0.5, 0.05, 5.0),),
        source="definition",
        checked=True,
    ),
)
