"""Steps, distances and tolerances of tracking, each with the reason for its value.

Amplitudes, frequencies and values of the parameter are compared relatively, tracks measured in
shares of their length. A solved maximum is accurate to some 1e-12.
"""

# One step of a maximum to other parameters.
MAX_DISTANCE = 0.3
"""Distance from the prediction beyond which the solution may be another maximum: the response has
changed by a third where first order foretold none of it."""
WINDOW, MAX_WINDOWS = 2e-3, 4
"""Half width of the first window of a search, about the width of a lightly damped peak, and the
number of windows, each four times as wide on one side: the last reaches over a tenth."""
WINDOW_POINTS = 2000
"""Most points of a window, where 29 were the most seen: a search ends in any case."""

# Step control of a track, and its events.
DESIRED_DISTANCE = 0.08
"""Distance of prediction and solution that is aimed at: a quarter of `MAX_DISTANCE`, the error of
the prediction grows with the square of the step, so twice the step is still accepted."""
FIRST_STEP, LARGEST_STEP = 0.05, 0.25
"""The first step may double at once; the longest shows the margins of events at four points."""
SMALLEST_STEP = 1e-4
"""Step below which a maximum counts as merged with a minimum: where they meet, derivatives grow
without bound, and no other step is refused that close."""
MOST_STEPS = 500
"""Most steps of a track, where 129 were the most seen: it ends in any case."""
EVENT_PRECISION = 1e-11
"""Distance from an event at which it counts as located: round-off of the margins, tenfold."""
RESTARTS = (1e-9, 1e-7, 1e-5, 1e-3, 1e-2)
"""Distances beyond an event at which the maximum is continued: from right behind its precision to
where unbounded derivatives at an onset of slip have become moderate."""
SAME_KIND_DISTANCE = 1e-4
"""Distance below which a maximum beyond an event must differ in kind from that before: closer, the
equations of the old kind still have a solution, which is no maximum further on."""
SEARCH_DISTANCE = 1e-3
"""Distance at which the maximum is searched for: once, as a search follows the whole response."""
MAX_SLOPE, MAX_JUMP = 10.0, 3e-3
"""Difference from the expected amplitude beyond which it is another maximum, over the distance and
at most: amplitudes go with low powers of parameters, and no track spans more than some decades."""
LIMIT_TOLERANCE = 1e-6
"""Slip margin, or distance from the end of the band, that counts as on the limit: far above the
margins that `EVENT_PRECISION` leaves, far below those of a contact in a definite state."""
MOST_ON_LIMIT = 3
"""Contacts on their limits whose states are tried in all combinations, eight; more of them are
those of sectors that move alike and change together."""
POLE_DISTANCE = 1e-2
"""Distance from a pole within which a growing maximum counts as unbounded."""
UNBOUNDED_AMPLIFICATION = 1e8
"""Ratio of inertia to exciting force above which a maximum counts as unbounded: no damping that a
structure has leaves so much."""

# Branches: which maxima are the same, and how they are interpolated.
SAME_MAXIMUM = 1e-8
"""Difference of amplitude and frequency below which two maxima are one: solved from both sides
they agree to 1e-9 at least."""
INTERPOLATION = 1e-5
"""Error allowed to cubic interpolation between two points: that which `peak_curve` promises."""
INTERPOLATION_DEPTH = 6
"""Halvings of an interval: the error of a cubic falls sixteenfold with each."""
SHORTEST_INTERVAL = 1e-7
"""Length of an interval that holds no further point or event: derivatives over it are round-off of
solved values."""
CROSSING_STEPS, CROSSING_PRECISION = 8, 1e-9
"""Newton steps to a crossing, and the last of them: convergence is quadratic, so that its error is
round-off."""

# The upper envelope.
SUBDIVISION = 4
"""Subdivisions of the interval between two solved values for comparing heights: two cubics cross
at most three times in it."""
ENVELOPE_DEPTH = 6
"""Halvings of an interval with several minima or exchanges."""
CROSSING_DISTANCE = 1e-5
"""Distance from where a peak crosses the end of the band within which both are equal: their
heights differ by its square, which is round-off."""
LARGEST_STEP_OF_LEAD = 1e-6
"""Difference of heights at an exchange beyond round-off: the largest response is continuous."""
SURVEY_OFFSET = 1e-3
"""Distance from a kink or a jump at which a survey verifies the envelope: there two maxima that
merge are apart."""
EVENT_DISTANCE = 1e-4
"""Distance from an event within which one further point on either side suffices."""
SAME_POINT, SAME_MINIMUM = 1e-12, 1e-9
"""Distances below which two points, or two minima, are one: round-off of a value, and of the value
at which a slope vanishes."""

# Surveys and the maxima followed from them.
AGREEMENT = 1e-9
"""Difference by which a survey may be higher than the followed branches: peaks of a survey are
located that accurately."""
CANDIDATE_SHARE = 0.9
"""Share of the largest response from which a maximum is followed: others reveal themselves by their
slopes, or at the next survey."""
SURVEYS_PER_DECADE = 6, 2
"""First surveys per decade: with many degrees of freedom, and with one, which has one peak."""
MIN_INTERVALS = 4, 2
"""Least number of intervals between the first surveys, likewise: each has a middle to verify it."""
FIRST_SHARE = 1e-3
"""Share of the largest value at which a band that begins at zero has its second survey: logarithmic
steps from zero never end."""
SURVEY_DEPTH = 7
"""How often an interval is halved: below one per cent of a value."""
MIN_INTERVAL = 0.08
"""Width of an interval below which it is halved only if surveys disagree: the spacing that
`peak_curve` documents."""
CONFIRMATIONS = 2
"""Surveys in a row that must agree, with many degrees of freedom: one may do so by chance."""
SLOPE_FACTOR = 2.0
"""Factor by which slopes between two surveys may exceed those at one of them."""
