"""``python -m symhbm``."""

from symhbm.cli import main

if __name__ == "__main__":
    main()
