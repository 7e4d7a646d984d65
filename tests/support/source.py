"""The package read as source: its files, functions and imports, and what its faces export."""

import ast
import importlib
import inspect
import sys
import types
import typing
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_type_hints

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "asperity"
Function = ast.FunctionDef | ast.AsyncFunctionDef


def files() -> Iterator[Path]:
    """What the package is made of."""
    return (
        path
        for path in sorted(PACKAGE.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    )


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"), str(path))


def modules(folder: Path = PACKAGE) -> Iterator[tuple[str, ast.Module]]:
    """Name below `folder` and syntax tree of every module there."""
    for path in sorted(folder.rglob("*.py")):
        yield path.relative_to(folder).as_posix(), parsed(path)


def functions(tree: ast.AST) -> Iterator[Function]:
    return (node for node in ast.walk(tree) if isinstance(node, Function))


def imports_inside_functions(tree: ast.Module) -> list[ast.stmt]:
    inside = (node for function in functions(tree) for node in ast.walk(function))
    return list(
        {
            id(node): node for node in inside if isinstance(node, ast.Import | ast.ImportFrom)
        }.values()
    )


def faces() -> dict[str, types.ModuleType]:
    """The modules that outside code imports from: every room's face, and the modules of rooms
    without one.
    """
    names = [path.parent.name for path in PACKAGE.glob("*/__init__.pyi")]
    names += [
        f"{room}.{path.stem}"
        for room in ("core", "contact")
        for path in (PACKAGE / room).glob("*.py")
        if path.stem != "__init__"
    ]
    return {name: importlib.import_module(f"asperity.{name}") for name in sorted(names)}


def exported(face: types.ModuleType) -> dict[str, Any]:
    """What a face hands out: the names of its stub, or the public names that a module defines
    itself.
    """
    if hasattr(face, "__path__"):
        return {name: getattr(face, name) for name in face.__all__}
    own = {
        name: value
        for name, value in vars(face).items()
        if getattr(value, "__module__", None) == face.__name__
    }
    return {name: value for name, value in own.items() if not name.startswith("_")}


def own_types(thing: Any) -> set[type]:
    """The classes of the package that a function takes or returns, or that a class holds or its
    methods return.
    """
    if inspect.isclass(thing):
        public = {name: member for name, member in vars(thing).items() if not name.startswith("_")}
        members = [_function(member) for member in public.values()]
        holds = {name: hint for name, hint in _hints(thing).items() if not name.startswith("_")}
        hints = [holds, *(_hints(member) for member in members if member)]
    else:
        hints = [_hints(thing)] if inspect.isfunction(thing) else []
    return {
        leaf for each in hints for hint in each.values() for leaf in _leaves(hint) if _is_own(leaf)
    }


def _function(member: Any) -> Any:
    """The function behind a method, a property, a cached property or a class method."""
    inner = (
        getattr(member, "fget", None)
        or getattr(member, "func", None)
        or getattr(member, "__func__", member)
    )
    return inner if inspect.isfunction(inner) else None


def _hints(thing: Any) -> dict[str, Any]:
    thing = inspect.unwrap(thing)
    module = sys.modules[thing.__module__]
    known = vars(typing) | vars(module) | _names_for_type_checkers(module.__name__)
    hints = {}
    for name, hint in inspect.get_annotations(thing).items():
        try:
            hints |= get_type_hints(types.SimpleNamespace(__annotations__={name: hint}), known)
        except TypeError:  # pandas' own are generic for type checkers only
            assert "pandas." in hint
    return hints


@cache
def _names_for_type_checkers(module: str) -> dict[str, Any]:
    """What a module imports below `if TYPE_CHECKING`."""
    names: dict[str, Any] = {}
    source = sys.modules[module].__file__
    for node in parsed(Path(source)).body if source else []:
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            exec(compile(ast.Module(node.body, []), source, "exec"), names)
    return names


def _leaves(hint: Any) -> Iterator[Any]:
    parts = [part for part in get_args(hint) if part is not hint]
    for part in parts:
        yield from (
            (leaf for inner in part for leaf in _leaves(inner))
            if isinstance(part, list)
            else _leaves(part)
        )
    if typing.get_origin(hint) is None or inspect.isclass(hint):
        yield hint


def _is_own(leaf: Any) -> bool:
    return inspect.isclass(leaf) and leaf.__module__.split(".")[0] == "asperity"
