"""Effects on the bed level [m]."""

from vegglue.effect import Amplitude, Array, Effect, Ground


def floor_level(ground: Ground, rise: Array) -> dict[str, Array]:
    """z_b + dz on the floor."""
    return {"bed": rise * (1.0 - ground.bank)}


EFFECTS = (
    Effect(
        name="floor_level_error",
        stage="site",
        title="The floor lies higher than surveyed",
        equation="z_b -> z_b + dz on the floor",
        act=floor_level,
        amplitude=Amplitude("rise", "m", "how much higher the floor lies than surveyed", 0.1, -0.5, 0.5),
        source="definition",
        checked=True,
    ),
)
