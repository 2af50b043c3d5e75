"""The frame of a model in the coordinates of a map: where its origin lies, and where its x axis points."""

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from vegglue.case.parts import Number, Part

# Systems whose coordinates are degrees, the usual ones; WGS 84 alone may be the datum of one in metres.
IN_DEGREES = {"EPSG:4326", "EPSG:4258", "EPSG:4269", "OGC:CRS84", "CRS84"}


def in_metres(crs: str) -> str:
    """The system, refused where its coordinates are degrees."""
    if crs.strip().upper() in IN_DEGREES:
        raise ValueError("a projected system, with coordinates in metres, such as EPSG:2056")
    return crs


class Frame(Part):
    """Takes and gives floats, or arrays of them: nothing of numpy is needed to read a case.

    x = (E - E_0) cos a + (N - N_0) sin a, y = (N - N_0) cos a - (E - E_0) sin a [m].
    """

    origin: tuple[Number, Number] = Field(description="east and north of x = y = 0 on the map [m]")
    angle: Number = Field(description="from east to the x axis, which runs downstream, anticlockwise [degrees]")
    crs: Annotated[str, AfterValidator(in_metres)] | None = Field(
        default=None, description="coordinate system of the map, such as EPSG:2056"
    )

    def to_model(self, east: Any, north: Any) -> tuple[Any, Any]:
        """x and y of places on the map [m]."""
        return self.turned_to_model(east - self.origin[0], north - self.origin[1])

    def to_map(self, x: Any, y: Any) -> tuple[Any, Any]:
        """East and north of places in the model [m]."""
        east, north = self.turned_to_map(x, y)
        return east + self.origin[0], north + self.origin[1]

    def turned_to_model(self, east: Any, north: Any) -> tuple[Any, Any]:
        """Components along and across of a vector whose components east and north are given."""
        cosine, sine = self._direction()
        return east * cosine + north * sine, north * cosine - east * sine

    def turned_to_map(self, along: Any, across: Any) -> tuple[Any, Any]:
        """Components east and north of a vector whose components along and across are given."""
        cosine, sine = self._direction()
        return along * cosine - across * sine, along * sine + across * cosine

    def _direction(self) -> tuple[float, float]:
        return math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
