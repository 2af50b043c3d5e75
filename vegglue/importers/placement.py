"""Where a channel lies on the map: a frame, and in it the centreline that the grid follows; neither, one or both.

A place on the map (E, N) is one of the frame (X, Y), and that one lies s along the centreline and n to its left.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.case.centreline import Centreline, along_and_across, heading_at, on_map
from vegglue.case.frame import Frame


@dataclass(frozen=True)
class Placement:
    """frame: of the model on the map, None where the map is that of the model; line: the centreline in the frame, None
    of a straight channel.
    """

    frame: Frame | None = None
    line: Centreline | None = None

    @property
    def turned(self) -> bool:
        """Whether the map and the channel have different coordinates."""
        return self.frame is not None or self.line is not None

    @property
    def words(self) -> str:
        """What is done with a place on the map."""
        return "the channel" if self.line is None else "lengths along and across the centreline"

    def to_channel(self, east: Array, north: Array) -> tuple[Array, Array]:
        """Along and across the channel [m] of places on the map (n,) [m]."""
        x, y = self.frame.to_model(east, north) if self.frame is not None else (east, north)
        return along_and_across(self.line, x, y) if self.line is not None else (x, y)

    def to_case(self, along: Array, across: Array) -> tuple[Array, Array]:
        """x and y as files of a case have them [m]: in the frame, where the centreline is drawn."""
        return on_map(self.line, along, across) if self.line is not None else (along, across)

    def to_map(self, along: Array, across: Array) -> tuple[Array, Array]:
        """East and north [m] of places along and across the channel."""
        x, y = self.to_case(along, across)
        return self.frame.to_map(x, y) if self.frame is not None else (x, y)

    def turned_to_channel(self, along: Array, east: Array, north: Array) -> tuple[Array, Array]:
        """Components along and across, at places so far along the channel, of a vector east and north.

        u = U cos(theta) + V sin(theta), v = V cos(theta) - U sin(theta), theta the direction of the centreline there.
        """
        u, v = self.frame.turned_to_model(east, north) if self.frame is not None else (east, north)
        if self.line is None:
            return u, v
        cosine, sine = (part(heading_at(self.line, along)) for part in (np.cos, np.sin))
        return u * cosine + v * sine, v * cosine - u * sine
