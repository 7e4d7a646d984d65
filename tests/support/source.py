"""The package read as source: its files, functions and imports, and the exports of its public
modules.
"""

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

from asperity.core import documents

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "asperity"
Function = ast.FunctionDef | ast.AsyncFunctionDef


def files() -> Iterator[Path]:
    """Yield the text files of the package."""
    return (
        path
        for path in sorted(PACKAGE.rglob("*"))
        if path.is_file() and path.suffix != ".npz" and "__pycache__" not in path.parts
    )


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"), str(path))


def modules(folder: Path = PACKAGE) -> Iterator[tuple[str, ast.Module]]:
    """Yield the name below `folder` and the syntax tree of every module there."""
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
    """Return the modules that outside code imports from: the face of each room, or the modules of a
    room without one.
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
    """Return the exports of a face: the names of its stub, or the public names that a module
    defines.
    """
    if hasattr(face, "__path__"):
        return {name: getattr(face, name) for name in face.__all__}
    own = {
        name: value
        for name, value in vars(face).items()
        if getattr(value, "__module__", None) == face.__name__
    }
    return {name: value for name, value in own.items() if not name.startswith("_")}


def own_types(item: Any) -> set[type]:
    """Return the package's classes among a function's parameters and results, or a class's fields
    and methods.
    """
    if inspect.isclass(item):
        public = {name: member for name, member in vars(item).items() if not name.startswith("_")}
        members = [_function(member) for member in public.values()]
        holds = {name: hint for name, hint in _hints(item).items() if not name.startswith("_")}
        hints = [holds, *(_hints(member) for member in members if member)]
    else:
        hints = [_hints(item)] if inspect.isfunction(item) else []
    return {
        leaf
        for group in hints
        for hint in group.values()
        for leaf in _leaves(hint)
        if _is_own(leaf)
    }


def _function(member: Any) -> Any:
    """Return the function of a method, a property, a cached property or a class method."""
    inner = (
        getattr(member, "fget", None)
        or getattr(member, "func", None)
        or getattr(member, "__func__", member)
    )
    return inner if inspect.isfunction(inner) else None


def _hints(item: Any) -> dict[str, Any]:
    item = inspect.unwrap(item)
    module = sys.modules[item.__module__]
    known = {**vars(typing), **vars(documents), **vars(module)}
    known |= _names_for_type_checkers(module.__name__)
    hints = {}
    for name, hint in inspect.get_annotations(item).items():
        try:
            hints |= get_type_hints(types.SimpleNamespace(__annotations__={name: hint}), known)
        except TypeError:  # pandas types are generic for type checkers only
            assert "pandas." in hint
    return hints


@cache
def _names_for_type_checkers(module: str) -> dict[str, Any]:
    """Return the names that a module imports below `if TYPE_CHECKING`."""
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
