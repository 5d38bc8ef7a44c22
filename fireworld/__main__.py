"""`python -m fireworld`: the command line."""

from fireworld.cli import main

main()
