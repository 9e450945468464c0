"""How the source is read where it leaves something open: for the page and `docs/claims.md`."""

READINGS: tuple[tuple[str, str], ...] = (
    (
        "Parameters",
        "damping, printed in N/m/s, is in N s/m; N_i of Fig. 5 is the normal load F_n of the text",
    ),
    (
        "Figs. 1, 2 and 5",
        "are drawings: Figs. 1 and 5 are drawn here from the models that are computed, Fig. 2 is "
        "the hysteresis loop of Fig. 4; the disk of Fig. 5 does not move, and contact i joins "
        "blades i and i + 1",
    ),
    (
        "Eqs. (9) to (11)",
        "are 2N + 2 equations for 2N + 2 unknowns, N being the number of harmonics; printed are "
        "N equations",
    ),
    (
        "Eq. (12)",
        "is the travelling wave f0 cos(omega t - 2 pi EO i / N); as printed it has no time, and an "
        "amplitude of sqrt(2) f0",
    ),
    ("Amplitude (dB)", "is 20 lg of the amplitude over 1 m; no reference is given"),
    (
        "Fig. 4",
        "compares one harmonic, MHBM and time; how many harmonics MHBM has is not told, here they "
        "are 1, 3 and 5; the loop is over x of Eq. (1), not over y = x - z, by which the spring of "
        "the contact is stretched",
    ),
    (
        "Fig. 6",
        "is what the text calls Fig. 5 under a force on one blade: the linear response, though "
        "contacts slip with the 100 N that are stated",
    ),
    (
        "Fig. 8",
        "has the caption `mono point (a) and Engine Order (b) excitation`; text and titles of its "
        "three parts say engine orders 1, 3 and 6, which are computed",
    ),
    (
        "Fig. 10",
        "is computed with F_n = 10 N as stated: peaks from -93.4 to -83.7 dB, on axes from -120 "
        "to -60 dB; 100 N would fill them, with peaks from -76.2 to -64.3 dB",
    ),
    (
        "Figs. 12 and 13",
        "draw contacts with variations of 40 % (mu), 20 % (k_d) and 30 % (F_n): half-widths of "
        "uniform distributions about the nominal values; blades 2, 6 and 10 count from 1; the "
        "amplification factor is the ratio at the same frequency, whose largest is near 77 Hz, not "
        "that of the peaks",
    ),
)
"""Figure or equation, and how it is read."""
