"""The command line ``symhbm``."""

from symhbm.cli.commands import main

__all__ = ["main"]
