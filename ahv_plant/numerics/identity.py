# Copyright 2026 ahv developers, Apache-2.0
"""What computes a result: the definitions that a function reaches by name, read from the sources.

The hash of them tells two codes apart whose numbers may differ, and only those: comments,
documentation and whatever is not reached leave it as it is. Sources are read and never imported,
so it depends on no import having happened, nor on their order.
"""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

HOUSE = Path(__file__).resolve().parents[2]
FAMILY = "ahv_"  # packages with such names are followed, beside a source's own package
# where results are kept says nothing of what they are
KEEPING = {"ahv_plant.numerics.identity", "ahv_plant.numerics.cache"}
EFFECTS = ""  # stands for what a source does beyond defining names


class Definition(NamedTuple):
    """A name of a source file; without a name all of the file."""

    source: Path
    name: str | None = None


class _Source:
    """A source file: which of its statements define a name, and what they do beyond that."""

    def __init__(self, path: Path):
        self.path = path
        root = path.parent
        while (root / "__init__.py").is_file():
            root = root.parent
        self._roots = (root, HOUSE)
        self._package = "" if root == path.parent else path.relative_to(root).parts[0]
        self.parts: list[ast.stmt] = []
        self.statements: dict[str, list[ast.stmt]] = {}  # that bind a name
        self.effects: list[ast.stmt] = []  # that may change what other names mean
        for statement in ast.parse(path.read_bytes()).body:
            for part in _parts(statement):
                self.parts.append(part)
                bound = set(_bound(part))
                for name in bound:
                    self.statements.setdefault(name, []).append(part)
                if not bound or _does_more(part):
                    self.effects.append(part)

    def reached(self, nodes: list[ast.stmt]) -> Iterator[Definition]:
        """Definitions that `nodes` name, of this source and of those that they import from."""
        for node in (inner for outer in nodes for inner in ast.walk(outer)):
            if isinstance(node, ast.Name):
                if node.id in self.statements:
                    yield Definition(self.path, node.id)
            elif isinstance(node, ast.Import):
                for module in node.names:
                    yield from self._imported(module.name, None, 0)
            elif isinstance(node, ast.ImportFrom):
                for member in node.names:
                    yield from self._imported(node.module or "", member.name, node.level)

    def _imported(self, module: str, member: str | None, level: int) -> Iterator[Definition]:
        """What an import brings in: a name of a file, or all of the file."""
        roots = (self.path.parents[level - 1],) if level else self._roots
        top = module.partition(".")[0]
        if module in KEEPING or not (
            level or top.startswith(FAMILY) or top == self._package or not self._package
        ):
            return
        parts = module.split(".") if module else []
        if member is not None:
            inner = _file_of(roots, [*parts, member])
            if inner is not None:  # a module of a package
                yield Definition(inner)
                return
        found = _file_of(roots, parts)
        if found is not None:
            yield Definition(found, None if member == "*" else member)


def _file_of(roots: tuple[Path, ...], parts: list[str]) -> Path | None:
    for root in roots:
        for path in (
            root.joinpath(*parts).with_suffix(".py"),
            root.joinpath(*parts, "__init__.py"),
        ):
            if parts and path.is_file():
                return path
    return None


def _parts(statement: ast.stmt) -> Iterator[ast.stmt]:
    """An import of several names as several imports, for not all of them need be reached."""
    if isinstance(statement, ast.Import):
        for name in statement.names:
            yield ast.Import([name])
    elif isinstance(statement, ast.ImportFrom):
        for name in statement.names:
            yield ast.ImportFrom(statement.module, [name], statement.level)
    else:
        yield statement


def _bound(statement: ast.AST) -> Iterator[str]:
    """Names that a statement of a module gives a meaning; of one with a body, all within."""
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        yield statement.name
    elif isinstance(statement, ast.Import | ast.ImportFrom):
        for one in statement.names:
            yield one.asname or one.name.partition(".")[0]
    elif isinstance(statement, ast.Assign | ast.AnnAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        for node in (inner for target in targets for inner in ast.walk(target)):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                yield node.id
    else:
        for child in ast.iter_child_nodes(statement):
            if isinstance(child, ast.Name) and isinstance(child.ctx, ast.Store):
                yield child.id
            yield from _bound(child)


def _does_more(statement: ast.stmt) -> bool:
    """Whether a statement can change what other names mean, as registering at a compiler does."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        calls = (one.func for one in statement.decorator_list if isinstance(one, ast.Call))
        return any(not (isinstance(one, ast.Name) and one.id == "dataclass") for one in calls)
    return not isinstance(statement, ast.Assign | ast.AnnAssign | ast.Import | ast.ImportFrom)


@cache
def _source(path: Path) -> _Source:
    return _Source(path)


@cache
def _follow(definition: Definition) -> tuple[bytes, frozenset[Definition]]:
    """Text of a definition without comments and documentation, and the definitions it names."""
    source = _source(definition.source)
    if definition.name is None:
        statements = source.parts
    elif definition.name == EFFECTS:
        statements = source.effects
    else:
        statements = source.statements.get(definition.name, [])
    for node in (inner for outer in statements for inner in ast.walk(outer)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                node.body = node.body[1:] or [ast.Pass()]
    text = "\n".join(ast.dump(statement) for statement in statements)
    return text.encode(), frozenset(source.reached(statements))


def read_anew() -> None:
    """Forget what was read: a source may have changed since."""
    _source.cache_clear()
    _follow.cache_clear()


def definitions(*roots: Definition) -> dict[Definition, bytes]:
    """All definitions that the `roots` reach, themselves among them, and their texts."""
    found: dict[Definition, bytes] = {}
    left = list(roots)
    while left:
        definition = left.pop()
        if definition not in found:
            found[definition], reached = _follow(definition)
            left.extend(reached)
            left.append(Definition(definition.source, EFFECTS))
    return found


def identity(*roots: Definition) -> str:
    """Hash of all that the `roots` reach; of files it is the name that counts, not the folder."""
    texts = sorted(
        f"{source.name} {name} ".encode() + text
        for (source, name), text in definitions(*roots).items()
    )
    return hashlib.sha256(b"\n".join(texts)).hexdigest()[:16]
