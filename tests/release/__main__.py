"""Make the files of a release, and check them: ``python -m tests.release``. It uploads nothing."""

import shutil
import tempfile
from pathlib import Path

import click

from tests.release.dependencies import check_dependencies
from tests.release.installation import ROOT, build, check_all, check_contents, fresh, run
from tests.release.metadata import disagreements, project


@click.command()
@click.option("--output", type=click.Path(path_type=Path), default=ROOT / "dist", show_default=True)
@click.option("--rehearse", is_flag=True, help="Only tell of uncommitted files and versions.")
def main(output: Path, rehearse: bool) -> None:
    """Build, check and try the last commit, and tell what is left to do."""
    faults = disagreements()
    if changed := run(["git", "status", "--porcelain"], ROOT):
        faults.append(f"not committed:\n{changed}")
    if faults and not rehearse:
        raise SystemExit("\n".join(faults))
    click.echo("\n".join(faults))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel, sdist = build(folder)
        check_contents(wheel, sdist)
        click.echo(check_dependencies(fresh(folder / "alone", [wheel]), folder))
        click.echo(check_all("release", wheel, sdist, folder))
        output.mkdir(parents=True, exist_ok=True)
        kept = [Path(shutil.move(path, output / path.name)) for path in (wheel, sdist)]
    for path in kept:
        click.echo(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
    about = project()
    if "Repository" not in about.get("urls", {}):
        click.echo("[project.urls] has no Repository: no links or pictures on the page of an index")
    if not faults:
        click.echo(f"Left to do: git tag -a v{about['version']}, git push --tags, twine upload")


if __name__ == "__main__":
    main()
