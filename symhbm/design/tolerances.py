"""Steps, distances and tolerances of a design, each with the reason for its value.

Designs and amplitudes enter as logarithms, so that all of them are relative. Maxima are located to
some 1e-12, and steps converge quadratically.
"""

import numpy as np

# The trust region of a descent.
FIRST_RADIUS, LARGEST_RADIUS = np.log(3.0), np.log(30.0)
"""Amplitudes go with low powers of the design over decades: their quadratic models hold for a
factor, seldom for more than a decade."""
SMALLEST_RADIUS = 1e-9
"""Radius below which no step leads down: ten times the last step of a minimum."""
PRECISION = 1e-10
"""Last step of a minimum: the next one would be round-off."""
ROUND_OFF = 1e-13
"""Change of the statistic that is round-off."""
HIDDEN = 1e-10
"""Gain of a short step that IPOPT's tolerance may hide: Newton's method gives the last digits."""
SMALL = 1e-3
"""Radius of the step whose multipliers are those at an optimum, and longest step of Newton's method
there: the models are exact to 1e-9 within it."""
DIGITS, MOST_POLISHES = 1e-12, 6
"""Last step of Newton's method, and the most of them: from 1e-3 four reach round-off."""
MOST_STEPS, MOST_SURVEYS = 100, 30
"""Most steps between two surveys, and most surveys of a descent: it ends in any case."""
AGREE = 1e-9
"""Largest difference of equal maxima: a survey locates them that accurately."""
STILL = 1e-12
"""Slope and curvature of a maximum that are round-off: it does not depend on the design."""

# The search: starts and descents.
SEED = 2013
"""Seed of the starts: a search is reproducible."""
NEARBY = np.log(3.0)
"""Distance of designs around another one: less than a descent reaches over."""
APART = np.log(25.0)
"""Distance of starts: a descent reaches over a factor of five on either side."""
DESCENTS = 3
"""Descents from the starts that are spread over the bounds, from the lowest: each costs several
surveys, and minima are few."""
FINER = 8
"""Times as many starts, and descents, where an end of a band is the highest: minima are a factor of
two apart there, not of five."""
TRIED = 32
"""Points from which a design that satisfies constraints is looked for."""
AROUND = 2
"""Starts around the best equal values, where values of one parameter may differ."""

# The maxima of a response.
CONTENDER = 0.7
"""Share of the largest response from which a maximum may be the largest at the next design: a step
by a factor of three seldom changes the order of others."""
FEW, MOST = 3, 60
"""Most contenders that are followed through changes of state, as a survey finds many at once; and
most of one response, as many as a disk of some tens of blades has."""

# Conditions of an optimum.
AT_BOUND = 1e-9
"""Distance to a bound that counts as zero: IPOPT stays a little inside."""
TIE = 1e-6
"""Largest difference of responses equal at a minimum: descents end within 1e-10."""
ACTIVE = 1e-7
"""Multiplier, of all that sum to 1, above which a maximum or a bound is active: those of the others
fall to IPOPT's tolerance."""
LEVEL = 1e-9
"""Curvature of the statistic that counts as zero: its round-off is 1e-15."""
STATIONARY = 1e-8
"""Largest slope of the statistic over those of the variables at an optimum: gradients of maxima
that almost cancel leave as much."""
VIOLATION = 1e-8
"""Largest excess over a constraint of size 1 that is round-off: IPOPT ends some 1e-9 beyond."""
