"""vegglue: calibrate models of flow through plants, and learn which effect they miss."""

__version__ = "0.1.0"
