"""The command line ``symhbm``."""

from symhbm.cli.transfer import main

__all__ = ["main"]
