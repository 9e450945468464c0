"""Machine code of CasADi functions, where there is a compiler of C."""

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import casadi as ca

_COMPILERS = ("cc", "gcc", "clang")
_FLAGS = ["-O1", "-ffp-contract=off"]
"""Every operation rounded by itself, as in CasADi's virtual machine: the same bits."""
_MOST_INSTRUCTIONS = 50_000
"""Length of a function that is compiled within seconds."""


def native(function: ca.Function) -> ca.Function | None:
    """The same function as machine code; None without a compiler, or for one that is too long."""
    compiler = next(filter(None, map(shutil.which, _COMPILERS)), None)
    if compiler is None or not function.is_a("SXFunction"):
        return None
    if function.n_instructions() > _MOST_INSTRUCTIONS:
        return None
    generator = ca.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    try:
        with TemporaryDirectory() as folder:
            source = Path(folder) / f"{function.name()}.c"
            source.write_text(generator.dump())
            options = dict(compiler=compiler, linker=compiler, flags=_FLAGS)
            options |= dict(directory=f"{folder}/", cleanup=False)
            return ca.external(function.name(), ca.Importer(str(source), "shell", options))
    except (OSError, RuntimeError):
        return None  # a compiler that fails, or a folder nothing may be run from
