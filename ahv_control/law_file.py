# Copyright 2026 ahv developers, Apache-2.0
"""Laws found by name or by file, and taken for somebody else's text until they are found good.

A name is that of a law of this package, or of an entry point of the group `ahv.laws` that any
installed package may have; what ends with .py is a file. What a law is, law.py says.
"""

import ast
import inspect
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, lru_cache
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from ahv_control.guidance import Guidance
from ahv_control.own_law import (
    FUNCTIONS,
    OwnLaw,
    compiled_functions,
    place_of,
    plain_functions,
)
from ahv_control.parameters import FLIGHT_CONTROL_PARAMETERS
from ahv_msgs_py.parameters import (
    BASE,
    SIMULATED_TIME,
    Parameter,
    ParameterError,
    Value,
    meant,
)
from ahv_plant.numerics.elementwise import CompilerError
from ahv_plant.numerics.identity import Definition, identity, read_anew
from ahv_plant.numerics.lane_rules import why_not_elementwise

GROUP = "ahv.laws"
OURS = "ahv_control.laws"  # package of the laws that come with this one
START, STEP = "start", "step"
ARGUMENTS = {
    START: ("measured", "reference", "settings"),
    STEP: ("memory", "before", "commands", "measured", "reference", "settings"),
}
# `gain: float = 2.0  # [1/s] of the pitch rate`
FIELD = re.compile(r"\s*(\w+)\s*:[^#]*#\s*(?:\[([^]]*)\])?\s*(.*)")
TELLING = ("Unknown attribute", "NameError", "Invalid use of", "Use of unsupported")  # of errors
LONGEST = 1_000_000  # [bytes] of a source that is read at all


class Law(NamedTuple):
    """A law that was loaded."""

    name: str
    source: Path
    identity: str  # hash of all that it reaches by name
    settings: type[Any]
    parameters: tuple[Parameter, ...]  # the settings as parameters of the node `flight_control`
    design: Callable[[Any], Any] | None
    kind: type[OwnLaw]  # its class: says which functions fly it
    why_plain: str  # what keeps it from being compiled; empty if nothing

    def control(
        self,
        values: Mapping[str, Value],
        altitude: float,
        speed: float,
        guidance: Guidance | None = None,
    ) -> OwnLaw:
        """The law as it flies with checked settings, to hold altitude [m] and speed [m/s].

        ParameterError if it cannot be designed with them.
        """
        settings = self.settings(**{name: values[name] for name in self.settings._fields})
        if self.design is not None:
            settings = _designed(self, settings)
        return self.kind(settings, altitude, speed, guidance)


def law_names() -> list[str]:
    """Laws that have a name: of this package, and of others that are installed."""
    return sorted({*_ours(), *_installed()})


@cache
def _installed() -> dict[str, str]:
    """Modules of the laws of other packages, by name."""
    return {entry.name: entry.module for entry in entry_points(group=GROUP)}


@cache
def _ours() -> dict[str, str]:
    """Modules of the laws of this package, by name."""
    if find_spec(OURS) is None:
        return {}
    folder = Path(str(import_module(OURS).__file__)).parent
    return {
        path.stem: f"{OURS}.{path.stem}"
        for path in sorted(folder.glob("*.py"))
        if not path.stem.startswith("_")
    }


def law_identity(name: str) -> str:
    """Hash of all that a law reaches by name; its source is read and not run.

    ParameterError if there is none.
    """
    _, source, _ = _found(name)
    return _identity(name, source)


def load_law(name: str) -> Law:
    """Load the law of a name or a file; ParameterError says what is wrong with it."""
    label, source, module = _found(name)
    return _loaded(label, source, module, _identity(label, source))


def _found(name: str) -> tuple[str, Path, str | None]:
    """Name, source and, if it is no file, module of a law."""
    module = _ours().get(name) or _installed().get(name)
    if module is not None:
        try:
            spec = find_spec(module)
        except (Exception, SystemExit) as error:
            raise ParameterError(f"law {name!r}: {module} cannot be imported: {error}") from error
        if spec is None or not spec.origin:
            raise ParameterError(f"law {name!r} should be in {module}, which is not there")
        return name, Path(spec.origin).resolve(), module
    path = Path(name)
    if path.suffix != ".py" or not path.is_file():
        known = law_names()
        raise ParameterError(
            f"law {name!r} is neither a file that ends with .py nor the name of one; "
            f"{meant(name, known)}named are {', '.join(known) or 'none'}"
        )
    return path.stem, path.resolve(), None


def _identity(name: str, source: Path) -> str:
    try:
        status = source.stat()
        if status.st_size > LONGEST:
            raise ParameterError(f"law {name!r}: {source.name} is larger than any law")
        return _identity_of(source, status.st_mtime_ns, status.st_size)
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ParameterError(f"law {name!r}: {place_of(error, source)}") from error


@cache
def _identity_of(source: Path, changed: int, size: int) -> str:
    """Identity of a source that was `changed` [ns] last, and has so many bytes."""
    read_anew()
    return identity(Definition(source))


@lru_cache
def _designed(law: "Law", settings: Any) -> Any:
    assert law.design is not None
    try:
        return law.design(settings)
    except (Exception, SystemExit) as error:
        raise ParameterError(
            f"law {law.name!r}: design() failed: {place_of(error, law.source)}"
        ) from error


@cache
def _loaded(name: str, source: Path, module: str | None, identity: str) -> Law:
    found = _run(name, source, module, identity)

    def refuse(why: str) -> ParameterError:
        return ParameterError(f"law {name!r}: {source.name} {why}")

    functions = {}
    for function, arguments in ARGUMENTS.items():
        given = getattr(found, function, None)
        if not callable(given):
            raise refuse(f"has no function {function}({', '.join(arguments)})")
        count = _arguments(given)
        if count is not None and count != len(arguments):
            raise refuse(f"has {function}() of {count} arguments, not of {', '.join(arguments)}")
        functions[function] = given
    settings = getattr(found, "Settings", None)
    if not (isinstance(settings, type) and issubclass(settings, tuple)) or not hasattr(
        settings, "_field_defaults"
    ):
        raise refuse("has no Settings, a NamedTuple with a default for every field")
    design = getattr(found, "design", None)
    if design is not None and not callable(design):
        raise refuse("has a design that is no function of the settings")
    parameters = _parameters(name, source, settings)
    why_plain = _why_plain(source, functions)
    # of a name that no other law's has: compiled code is kept, and found again, by it
    label = f"OwnLaw_{identity}"
    kind = type(label, (OwnLaw,), {"__slots__": (), "__module__": found.__name__})
    setattr(found, label, kind)
    if why_plain:
        start, step = (getattr(one, "py_func", one) for one in functions.values())
        FUNCTIONS[kind] = plain_functions(start, step, source)
    else:
        FUNCTIONS[kind] = compiled_functions(functions[START], functions[STEP], identity)
    return Law(name, source, identity, settings, parameters, design, kind, why_plain)


def _run(name: str, source: Path, module: str | None, identity: str) -> ModuleType:
    """Run the source of a law."""
    try:
        if module is not None:
            return import_module(module)
        label = f"{source.stem}_{identity}"
        spec = spec_from_file_location(label, source)
        assert spec is not None and spec.loader is not None
        found = module_from_spec(spec)
        sys.modules[label] = found
        if str(source.parent) not in sys.path:
            sys.path.append(str(source.parent))  # it may import what lies beside it
        spec.loader.exec_module(found)
        return found
    except (Exception, SystemExit) as error:
        raise ParameterError(
            f"law {name!r} cannot be imported: {place_of(error, source)}"
        ) from error


def _arguments(function: Any) -> int | None:
    """How many arguments a function takes; None if it does not tell, or takes any number."""
    try:
        parameters = inspect.signature(getattr(function, "py_func", function)).parameters.values()
    except (TypeError, ValueError):
        return None
    if any(one.kind is one.VAR_POSITIONAL for one in parameters):
        return None
    return sum(one.default is one.empty for one in parameters)


def _parameters(name: str, source: Path, settings: type[Any]) -> tuple[Parameter, ...]:
    """Settings as parameters, with unit and words from the comments behind the fields."""
    taken = {parameter.name for parameter in FLIGHT_CONTROL_PARAMETERS}
    taken |= {BASE, SIMULATED_TIME, "realtime", "autostart"}
    comments = _comments(source, settings.__name__)
    found = []
    for field in settings._fields:
        if field not in settings._field_defaults:
            raise ParameterError(f"law {name!r}: Settings.{field} has no default")
        default = settings._field_defaults[field]
        if type(default) not in (bool, int, float, str):
            raise ParameterError(
                f"law {name!r}: Settings.{field} is {type(default).__name__}, but must be a "
                "number, a truth or a text: design() may make others of them"
            )
        if field in taken:
            raise ParameterError(
                f"law {name!r}: Settings.{field} has the name of a parameter that the node has "
                "already: choose another"
            )
        unit, words = comments.get(field, ("", ""))
        unit = "" if unit == "-" else unit
        found.append(Parameter(field, default, words or f"setting of the law {name}", unit))
    return tuple(found)


def _comments(source: Path, owner: str) -> dict[str, tuple[str, str]]:
    """Unit and words behind every field of a class."""
    text = source.read_text(encoding="utf-8", errors="replace")
    found = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef) and node.name == owner:
            for line in text.splitlines()[node.lineno - 1 : node.end_lineno]:
                match = FIELD.fullmatch(line)
                if match:
                    found[match[1]] = (match[2] or "", match[3].strip())
    return found


def _why_plain(source: Path, functions: Mapping[str, Any]) -> str:
    """What keeps a law from being compiled; ParameterError where it is marked in vain."""
    marked = [name for name, function in functions.items() if _is_marked(function)]
    if not marked:
        return f"{START} and {STEP} of {source.name} are not marked @elementwise"
    if len(marked) < len(functions):
        return f"of {source.name} only {marked[0]} is marked @elementwise"
    why = why_not_elementwise(source, ARGUMENTS)
    if why:
        raise ParameterError(f"{why}; without @elementwise it flies as plain Python")
    return ""


def _is_marked(function: Any) -> bool:
    return hasattr(function, "elementwise")


@contextmanager
def compiling(law: Law | None) -> Iterator[None]:
    """Within, what a compiler says of a law that it does not take is said in a sentence."""
    try:
        yield
    except CompilerError as error:
        if law is None:
            raise
        raise _not_compiled(law, error) from error


def _not_compiled(law: Law, error: CompilerError) -> ParameterError:
    lines = [
        int(line)
        for file, line in re.findall(r'File "([^"\n]+)", line (\d+)', str(error))
        if Path(file).name == law.source.name
    ]
    said = [line.strip() for line in str(error).splitlines() if line.strip()]
    words = next(
        (line for line in reversed(said) if line.startswith(TELLING)),
        next((line for line in said if not line.startswith("Failed in")), ""),
    )
    if "Cannot unify Loop(" in str(error):
        words = "the memories that start and step answer are not of one type"
    where = f", line {lines[-1]}" if lines else ""
    return ParameterError(
        f"{law.source.name}{where}: it cannot be compiled ({words[:300]}); "
        "without @elementwise it flies as plain Python"
    )
