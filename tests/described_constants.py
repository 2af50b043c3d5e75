"""The constants that decide a verdict, as they are described where they stand."""

from dataclasses import dataclass, fields

from vegglue.decision_constants import DecisionConstants, Provenance, constants


@dataclass(frozen=True)
class Described:
    """A constant with its name, value, unit, provenance and basis."""

    name: str
    value: float
    unit: str
    provenance: Provenance
    basis: str
    near_one: bool


def described(values: DecisionConstants | None = None) -> list[Described]:
    """Every constant as it stands in `values`, the ones in use if not given."""
    chosen = values or constants()
    return [Described(one.name, getattr(chosen, one.name), **one.metadata) for one in fields(chosen)]
