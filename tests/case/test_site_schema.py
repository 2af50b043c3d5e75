"""What a config may say of a site and what the laws know go together."""

from typing import get_args

from vegglue.case.site_schema import COEFFICIENT_OF, FrictionClass, VegetationType
from vegglue.effects.bed_laws import BED_LAWS
from vegglue.effects.plant_laws import PLANT_LAWS


def test_a_config_knows_the_laws_there_are() -> None:
    assert get_args(FrictionClass.model_fields["law"].annotation) == BED_LAWS == tuple(COEFFICIENT_OF)
    assert get_args(VegetationType.model_fields["law"].annotation) == PLANT_LAWS


def test_each_law_of_the_bed_has_a_coefficient_of_its_own() -> None:
    for law, key in COEFFICIENT_OF.items():
        assert FrictionClass.model_validate({"law": law, key: 0.5}).coefficient == 0.5
