"""Laws of resistance: those of plants against their formulas written out again, their limits, and each other; those of
walls; and the logarithm and cube root that they use.
"""

import math
from typing import get_args

import numpy as np
import pytest
from channels import make_problem, planted, sloping, solved

from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.case.site_schema import VegetationType
from vegglue.diagnosis.effect_contract import CHANNEL
from vegglue.effects.bed_laws import CHEZY, KEULEGAN, MANNING, cube_root, logarithm, wall_coefficient
from vegglue.effects.plant_laws import PLANT_LAWS
from vegglue.flow.closures import drag
from vegglue.flow.equations import faces
from vegglue.flow.problem_setup import build_problem

G, KARMAN, BARE = 9.81, 0.41, 60.0


def of_law(law, phi, height, depth, bare=BARE, proportional=False):
    """C [m^1/2/s] that the solver uses."""
    shape = (4, 4)
    plants = planted(shape, phi, height, bare, law, proportional)
    problem = make_problem(np.zeros(shape), (1.0, 1.0), 1.0, 1.0, plants=plants)
    rate = drag(problem, np.full((*shape, 1), depth))
    assert np.ptp(rate) == 0.0
    return math.sqrt(G / (float(rate[0, 0, 0]) * depth))


def with_bed(plants, bare=BARE):
    return (1.0 / bare**2 + 1.0 / plants**2) ** -0.5


def of_drag_coefficient(depth, coefficient):
    """C of a stress rho CP U^2 / 2, as TELEMAC counts it."""
    return math.sqrt(2.0 * G / coefficient)


def huthoff(phi, top, h):
    """CP = C_D m D h / H^2, H = Z^(1/2) + (1 - Z) ((h - h_d)/s)^p, as TELEMAC's friction_huthoff has it."""
    z = min(top / h, 1.0)
    hm = math.sqrt(z) + (1.0 - z) * ((h - top) / 0.1) ** (2.0 / 3.0 * (1.0 - z**5))
    return of_drag_coefficient(h, phi / top * h / hm**2)


def luhar_nepf(phi, top, h):
    """CP = (C_v^(-1/2) (1 - Z)^(3/2) + Z / (C_D a h_d)^(1/2))^-2, as TELEMAC's friction_luharnepf has it."""
    z = min(top / h, 1.0)
    return of_drag_coefficient(h, (math.sqrt(1.0 / 0.1) * math.sqrt((1.0 - z) ** 3) + z / math.sqrt(phi)) ** -2)


def klopstra(phi, top, h):
    """The two layers as TELEMAC's friction_vanvelzen has them, with their exponentials in full."""
    area, alpha = phi / top, 0.0227 * top**0.7
    stem = math.sqrt(2.0 / area)
    ls = math.sqrt(alpha / area)
    k = (h - top) * ls / alpha / math.cosh(top / ls)
    a, b = math.sqrt(k * math.exp(top / ls) + stem**2), math.sqrt(k + stem**2)
    within = 2.0 * ls / top * (a - b)
    within += stem * ls / top * math.log((a - stem) * (b + stem) / (a + stem) / (b - stem))
    edge = math.sqrt(2.0 * k * math.sinh(top / ls) + stem**2)
    l = k * math.cosh(top / ls) / ls / edge  # noqa: E741
    hs = (1.0 + math.sqrt(1.0 + 4.0 * l**2 * KARMAN**2 * (h - top))) / (2.0 * l**2 * KARMAN**2)
    shear = math.sqrt(h - top + hs)
    z0 = hs * math.exp(-KARMAN * edge / shear)
    above = shear / KARMAN / (h - top) * (shear**2 * math.log(shear**2 / z0) - hs * math.log(hs / z0) - h + top)
    return (top / h * within + (h - top) / h * above) * math.sqrt(G / h)


def stone_shen(phi, top, h):
    """Balance of forces: g h S (1 - A) = phi/2 u_c^2, A the share of the volume that stems take up, u_c the speed
    between stems, u = u_c (1 - r) among plants, U = u (h/h_d)^(1/2).
    """
    r, slope = 0.05, 1e-3
    taken = math.pi / 4.0 * r**2 * top / h
    between = math.sqrt(2.0 * G * h * slope * (1.0 - taken) / phi)
    return between * (1.0 - r) * math.sqrt(h / top) / math.sqrt(h * slope)


def yang_choi(phi, top, h):
    """Speed among plants from the balance of forces; above it a log law from there, averaged by strips."""
    slope, grown = 1e-3, 1.0 if phi / top <= 5.0 else 2.0
    among = math.sqrt(2.0 * G * h * slope / phi)
    z = top + (np.arange(200000) + 0.5) / 200000 * (h - top)
    above = among + grown * math.sqrt(G * (h - top) * slope) / KARMAN * np.log(z / top)
    return float(top * among + (h - top) * above.mean()) / h / math.sqrt(h * slope)


FORMULAS = {
    "huthoff": huthoff,
    "klopstra": klopstra,
    "luhar-nepf": luhar_nepf,
    "stone-shen": stone_shen,
    "yang-choi": yang_choi,
}
OTHERS = tuple(FORMULAS)


def test_every_law_has_a_formula_here():
    assert set(OTHERS) == set(PLANT_LAWS) - {"baptist"}


@pytest.mark.parametrize("law", OTHERS)
@pytest.mark.parametrize(("phi", "top", "depth"), [(1.33, 0.8, 1.1), (8.0, 0.8, 1.1), (0.3, 0.2, 2.0), (5.0, 0.5, 0.6)])
def test_submerged_plants_resist_as_the_formula_says(law, phi, top, depth):
    assert of_law(law, phi, top, depth) == pytest.approx(with_bed(FORMULAS[law](phi, top, depth)), rel=1e-6)


@pytest.mark.parametrize("law", PLANT_LAWS)
def test_plants_that_stand_out_resist_alone(law):
    """C = (2g/phi)^(1/2) beside the bed; 0.95 (1 - pi/1600)^(1/2) of it for stone-shen. phi h/h_d when told so."""
    factor = 0.95 * math.sqrt(1.0 - math.pi / 1600.0) if law == "stone-shen" else 1.0
    assert of_law(law, 2.0, 0.8, 0.5) == pytest.approx(with_bed(factor * math.sqrt(2.0 * G / 2.0)), rel=1e-12)
    in_water = of_law(law, 2.0, 0.8, 0.5, proportional=True)
    assert in_water == pytest.approx(with_bed(factor * math.sqrt(2.0 * G / 1.25)), rel=1e-12)


@pytest.mark.parametrize("law", PLANT_LAWS)
def test_nothing_jumps_where_the_water_rises_over_the_plants(law):
    below, above = of_law(law, 3.0, 0.5, 0.5 - 1e-9), of_law(law, 3.0, 0.5, 0.5 + 1e-9)
    assert above == pytest.approx(below, rel=2e-5)  # luhar-nepf and huthoff start with a power below 1 or of 3/2


@pytest.mark.parametrize("law", PLANT_LAWS)
def test_laws_stay_finite(law):
    """From sparse to matted, short to tall, a film to a flood; and denser plants never resist less."""
    for top in (0.02, 0.5, 3.0):
        for depth in (1e-3, 0.999 * top, 1.001 * top, 5.0):
            found = [of_law(law, phi, top, depth) for phi in (1e-3, 0.5, 30.0, 5e3)]
            assert np.isfinite(found).all()
            assert min(found) > 0.0
            # Two do, by their own formulas: yang-choi doubles its log term where plants become dense, and to what runs
            # above, a dense canopy of klopstra far under water is a smooth bed.
            assert law in ("yang-choi", "klopstra") or (np.diff(found) < 1e-9).all()


@pytest.mark.parametrize("law", PLANT_LAWS)
def test_uniform_flow_over_plants_has_the_speed_of_the_law(law):
    """u = C (h S)^(1/2), 0.9 m of water over plants of 0.5 m."""
    slope, shape = 1e-3, (20, 3)
    chezy = of_law(law, 2.0, 0.5, 0.9)
    plants = planted(shape, 2.0, 0.5, BARE, law)
    speed = chezy * math.sqrt(0.9 * slope)
    bed = sloping(40.0, 20, 3, slope)
    problem = make_problem(bed, (2.0, 1.0), speed * 0.9 * 3.0, 0.9 - slope * 40.0, plants=plants, film=1e-5)
    assert faces(problem, solved(problem)).u == pytest.approx(speed, rel=1e-4)


def test_a_case_names_the_law_of_each_stand():
    stands = {
        "low": {**CHANNEL["plants"]["stands"]["low"], "law": "huthoff"},
        "high": CHANNEL["plants"]["stands"]["high"],
    }
    case = Case.model_validate(CHANNEL | {"source": "x", "plants": CHANNEL["plants"] | {"stands": stands}})
    plants = build_problem(case, build_site(case), "flow", {}).plants
    low = plants.column < 18
    assert {PLANT_LAWS[law] for law in plants.law[low]} == {"huthoff"}
    assert {PLANT_LAWS[law] for law in plants.law[~low]} == {"baptist"}
    assert set(PLANT_LAWS) == set(get_args(VegetationType.model_fields["law"].annotation))


FLOOR = 1.3


@pytest.mark.parametrize(
    ("law", "coefficient", "chezy"),
    [(MANNING, 0.01, 0.05 ** (1 / 6) / 0.01), (KEULEGAN, 0.001, 18.0 * np.log10(600.0)), (CHEZY, 60.0, 60.0)],
)
def test_the_coefficient_is_that_of_the_law_at_the_width_of_a_cell(law: int, coefficient: float, chezy: float) -> None:
    assert wall_coefficient(law, np.array([coefficient]), 0.05, FLOOR) == pytest.approx(9.81 / chezy**2)


def test_the_logarithm_is_bounded_as_on_banks() -> None:
    rough = wall_coefficient(KEULEGAN, np.array([0.5, 5.0]), 0.05, FLOOR)
    assert rough == pytest.approx(9.81 / (18.0 * np.log10(FLOOR)) ** 2)


def test_a_logarithmic_profile_over_the_cell_has_nearly_this_stress() -> None:
    """u(y) = u*/kappa ln(30 y/k_s), its mean over the cell: Keulegan's 12 and 18 are 7 % below it in the stress."""
    width, roughness = 0.05, 0.001
    mean = (np.log(30.0 * width / roughness) - 1.0) / 0.41
    assert wall_coefficient(KEULEGAN, np.array([roughness]), width, FLOOR) == pytest.approx(1.0 / mean**2, rel=0.08)


def test_logarithm_and_cube_root_are_right_to_four_units():
    """Against numpy in extended precision; its double ones err by up to three units."""
    x = np.concatenate([np.exp(np.random.default_rng(3).uniform(-40.0, 40.0, 20_000)), [1.0, 2.0, 0.5, 1e-12, 1e12]])
    x = np.concatenate([x, 1.0 + np.geomspace(1e-12, 0.5, 200), 1.0 - np.geomspace(1e-12, 0.5, 200)])
    found, cube = np.array([[logarithm(value), cube_root(value)] for value in x]).T
    wide = x.astype(np.longdouble)
    assert (np.abs(found - np.log(wide)) <= 4.0 * np.spacing(np.abs(np.log(x)))).all()
    assert (np.abs(cube - np.cbrt(wide)) <= 4.0 * np.spacing(np.cbrt(x))).all()
    assert logarithm(1.0) == 0.0
