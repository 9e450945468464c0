"""The quick start and the smoke set at the lower bounds of all dependencies, and at the newest.

``python -m tests.release.bounds``; ``--pins`` only prints the bounds as constraints of pip.
"""

import tempfile
from pathlib import Path

import click

from tests.release.installation import build, check_all
from tests.release.metadata import lowest


@click.command()
@click.option("--pins", is_flag=True, help="Only print the lower bounds, as constraints of pip.")
def main(pins: bool) -> None:
    """Install the last commit with old and with new dependencies, and test it."""
    if pins:
        click.echo("\n".join(lowest()))
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel, sdist = build(folder)
        click.echo(f"lowest: {check_all('lowest', wheel, sdist, folder, lowest())}")
        click.echo(f"newest: {check_all('newest', wheel, sdist, folder)}")


if __name__ == "__main__":
    main()
