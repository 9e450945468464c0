"""One change of one line of the library that makes it wrong, and what there is to change."""

import ast
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
_COMPARED = {
    ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==",
    ast.Is: "is not", ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in",
}  # fmt: skip
_COMPUTED = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Pow: "*", ast.BitAnd: "|",
    ast.BitOr: "&", ast.FloorDiv: "/", ast.Mod: "*",
}  # fmt: skip
_CALLED = {"min": "max", "max": "min", "any": "all", "all": "any", "sin": "cos", "cos": "sin",
           "floor": "ceil", "ceil": "floor", "argmin": "argmax", "argmax": "argmin"}  # fmt: skip


@dataclass(frozen=True)
class Mutation:
    """The text ``old`` from a place of a file on, which becomes ``new``."""

    file: str
    line: int
    column: int
    old: str
    new: str

    @property
    def key(self) -> str:
        """A name that tells it from others."""
        text = f"{self.file}:{self.line}:{self.column}:{self.old}:{self.new}"
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def applied(self, source: str) -> str:
        """The source of its file with the change; ValueError where the text is another one."""
        lines = source.splitlines(keepends=True)
        line = lines[self.line - 1]
        before, rest = line[: self.column], line[self.column :]
        if not rest.startswith(self.old):
            raise ValueError(f"{self.file}:{self.line}: {self.old!r} is not there")
        lines[self.line - 1] = before + self.new + rest[len(self.old) :]
        return "".join(lines)


def mutations_of(path: Path) -> Iterator[Mutation]:
    """All changes of a file that this knows: of operators, numbers, names and conditions."""
    source = path.read_text(encoding="utf-8")
    lines, file = source.splitlines(), path.relative_to(ROOT).as_posix()

    def changed(node: ast.expr, old: str, new: str, start: int) -> Iterator[Mutation]:
        column = lines[node.lineno - 1].find(old, start)
        if column >= 0:
            yield Mutation(file, node.lineno, column, old, new)

    tree = ast.parse(source)
    types = {id(part) for given in _annotations(tree) for part in ast.walk(given)}
    for node in ast.walk(tree):
        if id(node) in types:
            continue
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and _on_one_line(node):
            new = _COMPARED[type(node.ops[0])]
            segment = lines[node.lineno - 1][node.left.end_col_offset : node.end_col_offset]
            old = segment[: node.comparators[0].col_offset - node.left.end_col_offset].strip()
            yield from changed(node, old, new, node.left.end_col_offset or 0)
        elif isinstance(node, ast.BinOp) and _on_one_line(node) and type(node.op) in _COMPUTED:
            start, end = node.left.end_col_offset or 0, node.right.col_offset
            old = lines[node.lineno - 1][start:end].strip(" ()")
            if old:
                yield from changed(node, old, _COMPUTED[type(node.op)], start)
        elif isinstance(node, ast.BoolOp) and _on_one_line(node):
            old, new = (" and ", " or ") if isinstance(node.op, ast.And) else (" or ", " and ")
            yield from changed(node, old, new, node.values[0].end_col_offset or 0)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            old = "not " if isinstance(node.op, ast.Not) else "-"
            yield from changed(node, old, "", node.col_offset)
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            old = lines[node.lineno - 1][node.col_offset : node.end_col_offset]
            yield from changed(node, old, f"({old} + 1)", node.col_offset)
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield from changed(node, str(node.value), str(not node.value), node.col_offset)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute):
            name = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            if name in _CALLED:
                start = (node.func.end_col_offset or 0) - len(name)
                yield from changed(node.func, name, _CALLED[name], start)


def _annotations(tree: ast.Module) -> Iterator[ast.expr]:
    """Types, which no test can notice a change of."""
    for node in ast.walk(tree):
        given = getattr(node, "annotation", None), getattr(node, "returns", None)
        yield from (one for one in given if one is not None)


def _on_one_line(node: ast.expr) -> bool:
    return node.lineno == node.end_lineno


def sample(count: int, seed: int = 20261126) -> list[Mutation]:
    """As many changes, spread over the rooms by their code, the same for the same source."""
    generator = np.random.Generator(np.random.PCG64(seed))
    every = [one for path in sorted((ROOT / "symhbm").rglob("*.py")) for one in mutations_of(path)]
    rooms = sorted({room_of(one) for one in every})
    chosen: list[Mutation] = []
    for room in rooms:
        of_room = [one for one in every if room_of(one) == room]
        share = max(2, round(count * len(of_room) / len(every)))
        order = np.argsort(generator.random(len(of_room)))[:share]
        chosen += [of_room[i] for i in order.tolist()]
    return chosen


def room_of(mutation: Mutation) -> str:
    """The room of the library that a change is in, which is the folder of its tests."""
    return Path(mutation.file).parts[1].removesuffix(".py")
