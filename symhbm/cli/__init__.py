"""The command line ``symhbm``."""

from symhbm.cli.group import main

__all__ = ["main"]
