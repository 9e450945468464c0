"""Pages of archives: one file of HTML with curves to look into, for any browser."""

from symhbm.plot.viewer.view import view

__all__ = ["view"]
