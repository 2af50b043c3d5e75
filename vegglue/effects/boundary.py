"""Effects on what enters and leaves the reach."""

from vegglue.effect import Amplitude, Array, Boundary, Effect


def discharge_error(boundary: Boundary, relative_error: Array) -> dict[str, Array]:
    """Q -> Q (1 + e)."""
    return {"discharge": boundary.discharge * (1.0 + relative_error)}


EFFECTS = (
    Effect(
        name="discharge_error",
        stage="boundary",
        title="The discharge differs from the one reported",
        equation="Q -> Q (1 + e)",
        act=discharge_error,
        amplitude=Amplitude("relative_error", "-", "true over reported discharge, less one", 0.1, -0.5, 0.5),
        source="definition",
        checked=True,
        each="experiment",
    ),
)
