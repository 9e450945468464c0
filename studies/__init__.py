"""The figures of the source paper, one file each."""
