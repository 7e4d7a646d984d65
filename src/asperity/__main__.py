"""`python -m asperity`."""

from asperity.cli import main

main()
