"""``python -m symhbm``."""

import sys

from symhbm.cli import main

if __name__ == "__main__":
    sys.exit(main())
