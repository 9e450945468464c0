"""Cases that other programs publish or test against, a part of the report for each."""

from collections.abc import Callable
from functools import partial

from tests.reference import CASES
from tests.validation import beams, oscillators
from tests.validation.comparison import Comparison, Part, computed

Case = Callable[[str, bool], list[Comparison]]

WORDS: dict[str, tuple[Case, str]] = {
    "nlvib01_duffing": (
        oscillators.duffing,
        "The print is the largest point of a path; ours is the peak itself, located.",
    ),
    "nlvib03_stop": (
        oscillators.stop,
        "With 1024 samples a period balances have spurious maxima and a dozen spurious folds "
        "near 0.7555 rad/s; located contacts have one peak and one fold. The print marks points "
        "beyond a period doubling and a Neimark-Sacker bifurcation in a figure; where these are "
        "is found here, and by multipliers of exact motions that SciPy integrates and closes. "
        "What differs is the truncation: with harmonics up to 41 they agree to 5e-5.",
    ),
    "nlvib04_nnm_two_masses": (
        oscillators.two_modes,
        "Both modes over all amplitudes of the reference.",
    ),
    "nlvib07_mixed_chain": (
        oscillators.chain,
        "Where each slider slips within the period, all agree. Where one only sticks its static "
        "force is not determined: it is centred between its extremes here, while a march from "
        "rest, as in NLvib, leaves another one. The motions differ there: NLvib prints the "
        "largest root mean square of the third mass as 0.699148 at 1.6642 rad/s, where its "
        "second slider is held off centre; here it is 0.698613 at 1.6244. The folds between "
        "1.626 and 1.658 rad/s, that samples of others do not report, stay with more harmonics, "
        "and all seven motions between them solve a sampled balance of our own that centres as "
        "well.",
    ),
    "nlvib08_beam_tanh": (
        beams.dry_beam,
        "The print is off by 8e-4 in the root mean square and by 2 % in the third harmonic, by "
        "the stopping tolerance of a solver on unknowns of 1e-8 m; two other programs agree to "
        "1e-12.",
    ),
    "nlvib09_beam_cubic_nnm": (
        beams.tip_spring,
        "At 187 rad/s five times the frequency is that of the second mode: the amplitude turns "
        "back there, and comes to zero while that mode moves alone. The path goes on beyond zero, "
        "and reaches the other side of the resonance, where the independent balance agrees to "
        "1e-11; programs that step over it go on at once. Printed 259.862 rad/s, 259.929 here: "
        "the print is off by 3e-4. Its element integrals, not exact, are off by 5e-5 in the "
        "linear frequency.",
    ),
    "tmdsimpy_duffing3_evaluation": (
        oscillators.evaluation,
        "The equations at a state that solves nothing, as MATLAB has them.",
    ),
    "iwan4_segalman": (
        beams.iwan,
        "An Iwan element is sliders in parallel; 500 of them are within 1e-4 of infinitely "
        "many, and exact as what they are.",
    ),
    "skhippr_duffing_folds": (
        oscillators.stiff_duffing,
        "Exactly two changes of stability, both folds.",
    ),
    "juliajim_forced_van_der_pol": (
        oscillators.van_der_pol,
        "The driven cycle loses its stability where the mean damping vanishes, whatever the "
        "harmonics.",
    ),
    "friction_beam_elastic": (
        beams.rubbing_beam,
        "The independent balance samples 4096 times a period; here slip is located.",
    ),
}
"""How each is compared, and what is to be known of it.

The beam of Brake and Reuss with rough contact is no case: no law of the library is that of its
contact, and its matrices are not published.
"""


def parts(quick: bool) -> list[Part]:
    """A part for each case."""
    return [
        computed(CASES[name]["title"], words, partial(case, name, quick))
        for name, (case, words) in WORDS.items()
    ]
