"""Whether files and folders are of this user alone, so that code in them may be run.

Who may write a folder may put something else in the place of what it holds, so that all folders on
the way count, and those that symbolic links lead through. The administrator may write anywhere,
and so may the group that many systems make for each user alone.
"""

import os
import stat
from functools import cache
from pathlib import Path


def is_own(path: Path) -> bool:
    """Whether nobody else can write what is at a path, or put something else there."""
    if os.name == "nt":
        return True
    try:
        return not _is_open(path.stat()) and _is_held(path.absolute())
    except OSError:  # nothing is there, or links lead in a circle
        return False


def is_own_file(path: Path) -> bool:
    """Whether a path in a folder of this user is a file of the same, and no symbolic link."""
    status = path.lstat()
    if os.name == "nt":
        return stat.S_ISREG(status.st_mode)
    return stat.S_ISREG(status.st_mode) and _is_ours(status) and not _is_open(status)


def own_folder(path: Path) -> bool:
    """Whether a folder is of this user alone; it is made where there is none."""
    for folder in reversed((path := path.absolute(), *path.parents)):
        if not folder.exists():
            if os.name != "nt" and not _is_held(folder.parent):
                return False
            folder.mkdir(mode=0o700, exist_ok=True)
    return path.is_dir() and is_own(path)


def _is_held(path: Path) -> bool:
    """Whether nobody else can put something else at an absolute path."""
    status = path.lstat()
    if not _is_ours(status) or (path != path.parent and not _is_held(path.parent)):
        return False
    if stat.S_ISLNK(status.st_mode):
        return _is_held(path.parent / path.readlink())
    return not _is_open(status) or bool(status.st_mode & stat.S_ISVTX)


def _is_ours(status: os.stat_result) -> bool:
    return status.st_uid in (0, os.getuid())


def _is_open(status: os.stat_result) -> bool:
    """Whether others than its owner may write."""
    by_group = status.st_mode & stat.S_IWGRP and not _is_private(status.st_gid)
    return bool(by_group or status.st_mode & stat.S_IWOTH)


@cache
def _is_private(group: int) -> bool:
    """Whether a group is this user's, of the same name and without other members."""
    import grp
    import pwd

    try:
        user, told = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    is_own_name = (user.pw_name, user.pw_gid) == (told.gr_name, group) and user.pw_uid != 0
    return is_own_name and set(told.gr_mem) <= {user.pw_name}
