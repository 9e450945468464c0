"""Files are of a user alone where nobody else can write or replace them."""

import os
from types import SimpleNamespace

import pytest

from symhbm.numerics import machine_code
from symhbm.numerics.machine_code import is_own, is_own_file, own_folder

IS_PRIVATE = machine_code._is_private
pytestmark = pytest.mark.skipif(os.name == "nt", reason="modes of files are of other systems")


@pytest.fixture(autouse=True)
def no_group_of_this_user(monkeypatch):
    """Whoever runs the tests, groups have others among them."""
    monkeypatch.setattr(machine_code, "_is_private", lambda group: False)


def test_every_folder_above_counts(tmp_path):
    target = tmp_path / "a" / "b" / "c"
    assert own_folder(target)
    assert [each.stat().st_mode & 0o777 for each in (target, *target.parents[:2])] == [0o700] * 3
    for folder in (target, target.parent, target.parents[1]):
        for mode in (0o770, 0o707):
            folder.chmod(mode)
            assert not is_own(target)
            assert not own_folder(target)
        folder.chmod(0o700)
        assert is_own(target)


def test_names_in_a_folder_for_all_are_kept_by_its_sticky_bit(tmp_path):
    """Only its owner renames or removes what is in it, as in /tmp."""
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    assert own_folder(shared / "mine")
    assert not is_own(shared)


def test_nothing_is_made_below_what_others_may_write(tmp_path):
    tmp_path.chmod(0o777)
    assert not own_folder(tmp_path / "a" / "b")
    assert not (tmp_path / "a").exists()


def test_links_count_as_the_folders_they_lead_through(tmp_path):
    safe, open_folder = tmp_path / "safe", tmp_path / "open"
    target = safe / "target"
    target.mkdir(parents=True)
    open_folder.mkdir()
    (safe / "link").symlink_to("../safe/target")
    (open_folder / "link").symlink_to(target)
    (safe / "around").symlink_to(open_folder / "link")
    assert is_own(safe / "link")
    assert is_own(safe / "around")
    open_folder.chmod(0o777)
    assert not is_own(open_folder / "link")
    assert not is_own(safe / "around")
    assert is_own(target)


def test_circles_of_links_and_missing_folders_are_nobodys(tmp_path):
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    assert not is_own(tmp_path / "a")
    assert not is_own(tmp_path / "none")


@pytest.mark.skipif(os.name == "nt" or os.getuid() != 0, reason="only root gives files away")
def test_what_belongs_to_others_is_not_own(tmp_path):
    target = tmp_path / "a" / "b"
    assert own_folder(target)
    for path in (target, target.parent):
        os.chown(path, 65534, 65534)
        assert not is_own(target)
        os.chown(path, 0, 0)
    file = target / "file"
    file.touch(0o600)
    assert is_own_file(file)
    os.chown(file, 65534, 65534)
    assert not is_own_file(file)


def test_own_files_are_no_links(tmp_path):
    file, link = tmp_path / "file", tmp_path / "link"
    file.touch(0o600)
    link.symlink_to(file)
    assert is_own_file(file)
    assert not is_own_file(link)
    assert not is_own_file(tmp_path)
    file.chmod(0o620)
    assert not is_own_file(file)


def test_the_group_of_a_user_alone_may_write(tmp_path, monkeypatch):
    target = tmp_path / "target"
    target.mkdir()
    target.chmod(0o770)
    monkeypatch.setattr(machine_code, "_is_private", lambda group: group == target.stat().st_gid)
    assert is_own(target)
    target.chmod(0o772)
    assert not is_own(target)


@pytest.mark.parametrize(
    ("user", "group", "private"),
    [
        (("ann", 7, 7), ("ann", []), True),
        (("ann", 7, 7), ("ann", ["ann"]), True),
        (("ann", 7, 7), ("ann", ["bob"]), False),
        (("ann", 7, 7), ("staff", []), False),
        (("ann", 7, 8), ("ann", []), False),
        (("root", 0, 7), ("root", []), False),
        (("ann", 7, 7), None, False),
    ],
)
def test_a_group_is_private_by_its_name_and_members(monkeypatch, user, group, private):
    def told(number):
        if group is None:
            raise KeyError(number)
        return SimpleNamespace(gr_name=group[0], gr_mem=group[1])

    name, uid, gid = user
    of_user = SimpleNamespace(pw_name=name, pw_uid=uid, pw_gid=gid)
    monkeypatch.setattr("pwd.getpwuid", lambda number: of_user)
    monkeypatch.setattr("grp.getgrgid", told)
    assert IS_PRIVATE.__wrapped__(7) == private
