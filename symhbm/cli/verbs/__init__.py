"""The commands of ``symhbm``, one file each; a new file is a new command."""
