"""The version, which every result carries."""

VERSION = "0.2.0"
