"""`python -m vegglue` is `vegglue`."""

from vegglue.cli.main import main

main()
