"""A few tests of each room, which tell in two minutes of CPU time whether an installation works."""

SMOKE = (
    "tests/numerics/test_fourier.py",
    "tests/numerics/test_interpolation.py",
    "tests/model/files/test_arrays.py",
    "tests/model/files/test_hdf5.py",
    "tests/model/files/test_matrix_market.py",
    "tests/model/reduction/test_craig_bampton.py::test_a_sector_converges_to_its_waves",
    "tests/balance/test_harmonic_balance.py",
    "tests/continuation/test_path.py",
    "tests/time_domain/test_exact_motion.py::test_reference_values",
    "tests/results/test_archive.py::test_rebuilt_problem_is_the_original",
    "tests/results/reading/test_frames.py",
    "tests/peaks/test_sensitivity.py::test_which_contact_matters_most",
    "tests/response/test_solve.py::test_friction_diagnostics_of_the_describing_function",
    "tests/response/test_frf.py::test_peaks_of_figure_3",
    "tests/response/test_verify.py::test_sound_archives_pass",
    "tests/design/test_variables.py",
    "tests/ensembles/test_statistics.py::test_envelope_is_that_of_numpy",
    "tests/ensembles/test_mistuning.py::test_marginals_are_those_asked_for",
    "tests/plot/test_figures.py",
)
"""The quick start is run beside them, with its commands: the tests of the command line need a
newer click than users do."""
