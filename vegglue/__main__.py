"""`python -m vegglue` is `vegglue`."""

from vegglue.cli import main

main()
