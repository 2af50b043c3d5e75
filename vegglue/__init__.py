"""vegglue: calibrate models of flow through plants, and learn which effect they miss."""

from vegglue import version

__version__ = version.VERSION

__all__ = ["__version__"]
