"""Points of datasets computed again from their coefficients alone."""

from symhbm.response.verification.figures import FIGURES
from symhbm.response.verification.verify import summary, verify

__all__ = ["FIGURES", "summary", "verify"]
