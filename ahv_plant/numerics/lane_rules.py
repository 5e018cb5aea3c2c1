# Copyright 2026 ahv developers, Apache-2.0
"""What keeps a function from being element-wise, read from its source: one sentence with its line.

A compiler would find most of it, and say so in its own words; a call of libm it would compile, to
bits that another machine's libm does not give.
"""

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

from ahv_plant.numerics.identity import Definition, definitions

OF_LIBM = ("math", "cmath", "numpy")
ROUNDED_ALIKE = {"sqrt", "fabs"}  # IEEE 754 says to the last bit what they answer
OPERATORS: dict[type[ast.AST], str] = {
    ast.Pow: "a power: write it as products, or call power() of ahv_plant.numerics.elementary",
    ast.Mod: "a remainder, which lanes do not have",
    ast.FloorDiv: "a division that rounds down, which lanes do not have",
    ast.MatMult: "a product of matrices: write it out, number by number",
    ast.NotEq: "a comparison by !=, which lanes do not have: choose by == the other way round",
}


def why_not_elementwise(source: Path, names: Iterable[str]) -> str:
    """What keeps the functions `names` of a source from lanes, with its line; empty if nothing.

    Functions that they call are looked at too, if they stand in the same source.
    """
    tree = ast.parse(source.read_bytes())
    reached = {
        definition.name
        for definition in definitions(*(Definition(source, name) for name in names))
        if definition.source == source
    }
    libm = dict(_of_libm(tree))
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef) and statement.name in reached:
            for node in _inside(statement):
                why = _why(node, libm)
                if why:
                    return f"{source.name}, line {getattr(node, 'lineno', 0)}: {why}"
    return ""


def _of_libm(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Names that stand for a module whose functions differ from machine to machine, or for one."""
    for statement in ast.walk(tree):
        if isinstance(statement, ast.Import):
            for one in statement.names:
                if one.name.partition(".")[0] in OF_LIBM:
                    yield one.asname or one.name.partition(".")[0], one.name
        elif isinstance(statement, ast.ImportFrom) and statement.module in OF_LIBM:
            for one in statement.names:
                yield one.asname or one.name, f"{statement.module}.{one.name}"


def _inside(function: ast.FunctionDef) -> Iterator[ast.AST]:
    for statement in function.body:
        yield from ast.walk(statement)


def _why(node: ast.AST, libm: dict[str, str]) -> str:
    if isinstance(node, ast.If | ast.IfExp | ast.While) and not _of_none(node.test):
        kind = "a loop" if isinstance(node, ast.While) else "a branch"
        return f"{kind} on a number, which lanes cannot follow each its own way: use select()"
    if isinstance(node, ast.BoolOp) and not _of_none(node):
        return "`and` or `or` of numbers: use & and |, with brackets around the comparisons"
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return "`not` of a number: choose the other way round by select()"
    if isinstance(node, ast.Compare):
        if len(node.ops) > 1:
            return "two comparisons in one, which is an `and`: use &, with brackets around both"
        return OPERATORS.get(type(node.ops[0]), "")
    if isinstance(node, ast.BinOp):
        return OPERATORS.get(type(node.op), "")
    if isinstance(node, ast.Call):
        return _why_not_called(node.func, libm)
    return ""


def _of_none(test: ast.AST) -> bool:
    """Whether a condition asks for None alone, which is known before there are numbers."""
    if isinstance(test, ast.BoolOp):
        return all(map(_of_none, test.values))
    return isinstance(test, ast.Compare) and all(
        isinstance(one, ast.Is | ast.IsNot) for one in test.ops
    )


def _why_not_called(function: ast.expr, libm: dict[str, str]) -> str:
    if isinstance(function, ast.Name) and function.id == "min":
        return "a call of min(), which lanes do not have: write -max(-a, -b)"
    if isinstance(function, ast.Name) and function.id in libm:
        name = libm[function.id]
    elif isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
        module = libm.get(function.value.id)
        name = f"{module}.{function.attr}" if module else ""
    else:
        name = ""
    if not name or name.rpartition(".")[2] in ROUNDED_ALIKE:
        return ""
    return (
        f"a call of {name}(), whose last bit differs from machine to machine: "
        "ahv_plant.numerics.elementary has functions that do not"
    )
