"""Generate the pages of the reference: Python names, commands, keys of a case, keys of JSON.

Their sources are those of the program: the stub of its names, typer's commands, pydantic's sections
and the catalogue of quantities. The structure of JSON comes from the golden numbers, which tests
compare with every command.
"""

import ast
import re
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, get_args

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from asperity.core.quantities import catalogue  # noqa: E402
from support.vocabulary import case_sections, commands, golden  # noqa: E402

GROUPS = {  # of names, by the module that exports them
    "Contacts and bodies": ("contact.conditions", "contact.grid", "surface"),
    "Oils": ("lubricant",),
    "Solving a contact": ("ehl", "solution", "core.errors"),
    "Case files, runs, studies": ("case", "results", "study", "simulation", "report"),
    "Vibration": ("coupling", "vibration", "core.signals"),
    "Recordings, wear stage, inference": (
        "recording",
        "resonance",
        "trend",
        "monitoring",
        "inference",
    ),
}

JSON = """With `--json` a command prints one object: numbers in SI, `null` for missing values. \
Dots separate nested keys; [] denotes each entry of a list."""


def pages() -> dict[str, str]:
    """Return the text of each page by its path in the site's source."""
    return {
        "reference/api.rst": api_page(),
        "reference/commands.md": commands_page(),
        "reference/case-keys.md": case_page(),
        "reference/json-keys.md": json_page(),
    }


def public_names() -> dict[str, list[str]]:
    """Return the public names of `asperity` by the module that exports them."""
    stub = ast.parse((ROOT / "src" / "asperity" / "__init__.pyi").read_text("utf-8"))
    names: dict[str, list[str]] = {}
    for node in stub.body:
        if isinstance(node, ast.ImportFrom):
            names.setdefault(str(node.module), []).extend(alias.name for alias in node.names)
    return names


def api_page() -> str:
    """Return the page of public names, grouped by topic."""
    names = public_names()
    grouped = {module for modules in GROUPS.values() for module in modules}
    groups = GROUPS | {module.capitalize(): (module,) for module in names if module not in grouped}
    parts = [
        "Python",
        "======",
        "",
        "``import asperity as asp``. All values are in SI. Modules are loaded on first use.",
    ]
    for title, modules in groups.items():
        listed = [f"   {name}" for module in modules for name in names[module]]
        options = ["   :toctree: names", "   :nosignatures:"]
        parts += [
            "",
            title,
            "-" * len(title),
            "",
            ".. currentmodule:: asperity",
            "",
            ".. autosummary::",
            *options,
            "",
        ]
        parts += listed
    return "\n".join([*parts, ""])


def commands_page() -> str:
    """Return the page of commands, from typer."""
    parts = [
        "# Commands",
        "",
        "The texts of `--help`. [Command line](../command-line.md) explains the output.",
    ]
    for name, command in commands().items():
        options = [
            entry
            for entry in command.params
            if entry.opts[0].startswith("-") or entry.param_type_name == "argument"
        ]
        usage = " ".join(_usage(entry) for entry in options if entry.param_type_name == "argument")
        summary = (command.help or "").strip().replace("\n", " ")
        parts += ["", f"## asperity {name}".rstrip(), "", summary, "", "```text"]
        parts += [" ".join(f"asperity {name} {usage} [OPTIONS]".split()), "```", ""]
        parts += _table(("", "value", "default", "meaning"), [_option(entry) for entry in options])
    return "\n".join([*parts, ""])


def _usage(entry: Any) -> str:
    name = (entry.metavar or entry.name.upper()) + ("..." if entry.nargs == -1 else "")
    return name if entry.required else f"[{name}]"


def _option(entry: Any) -> tuple[str, ...]:
    argument = entry.param_type_name == "argument"
    names = [_usage(entry)] if argument else [*entry.opts, *entry.secondary_opts]
    kind = getattr(entry.type_descriptor.annotation, "__name__", "").replace("str", "text").upper()
    value = "" if argument or entry.is_flag else entry.metavar or kind
    default = (
        ""
        if entry.default in (None, False, ()) or callable(entry.default)
        else f"`{entry.default}`"
    )
    return (
        ", ".join(f"`{name}`" for name in names),
        f"`{value}`" if value else "",
        default,
        _cell(entry.help or ""),
    )


def case_page() -> str:
    """Return the page of case keys; docs/case-file.md explains them."""
    parts = [
        "# Keys of a case file",
        "",
        "[The case file](../case-file.md) explains each key and its default.",
    ]
    for name, section in sorted(
        case_sections().items(), key=lambda item: (item[0] != "Top level", item[0])
    ):
        rows = [_key(*item) for item in section.model_fields.items()]
        parts += [
            "",
            f"## {name.replace('file = ', 'file = ...')}",
            "",
            *_table(("key", "takes", "default"), rows),
        ]
    return "\n".join([*parts, ""])


def _key(name: str, field: Any) -> tuple[str, ...]:
    inside = list(_parts(field.annotation, *field.metadata))
    units = [
        part.args[0]
        for part in inside
        if isinstance(part, partial) and part.func.__name__ == "parse_amount"
    ]
    choices = [f"`{part}`" for part in inside if isinstance(part, str)]
    plain = [word for kind, word in PLAIN.items() if kind in inside]
    default = (
        "required" if field.is_required() else _shown(field.get_default(call_default_factory=True))
    )
    return (
        f"`{name}`",
        ", ".join([f"amount in {units[0]}"] if units else choices or plain or ["table"]),
        default,
    )


PLAIN = {bool: "true or false", int: "whole number", float: "number", str: "text"}


def _parts(*annotations: Any) -> Iterator[Any]:
    """Yield the types, choices and validators of annotations."""
    for part in annotations:
        yield from _parts(*get_args(part))
        yield from _parts(*getattr(part, "__metadata__", ()))
        yield getattr(part, "func", None) if hasattr(part, "json_schema_input_type") else part


def _shown(default: Any) -> str:
    if default is None:
        return "none"
    if isinstance(default, tuple):
        return ", ".join(map(_shown, default))
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    text = getattr(default, "text", default)
    return "a table of defaults" if hasattr(type(text), "model_fields") else f"`{text}`"


def json_page() -> str:
    """Return the page of `--json` keys by command, from the golden numbers."""
    parts = ["# Keys of JSON", "", JSON]
    for command in commands():
        if trees := golden(command):
            kinds = {path: kind for tree in trees for path, kind in _leaves(tree)}
            rows = [(f"`{path}`", kind, *_meaning(path)) for path, kind in kinds.items()]
            parts += ["", f"## {command}", "", *_table(("key", "holds", "unit", "is"), rows)]
    return "\n".join([*parts, ""])


def _leaves(tree: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield the path and type of every value that is no object."""
    if isinstance(tree, dict):
        for key, inner in tree.items():
            yield from _leaves(inner, f"{path}.{key}".lstrip("."))
    elif isinstance(tree, list) and tree and isinstance(tree[0], dict):
        for entry in tree:
            yield from _leaves(entry, f"{path}[]")
    else:
        yield (
            path,
            {bool: "true or false", str: "text", list: "list", type(None): ""}.get(
                type(tree), "number"
            ),
        )


def _meaning(path: str) -> tuple[str, str]:
    """Return unit and name by the catalogue; a deviation takes those of its value."""
    key = re.split(r"[.\]]+", path.removesuffix("[]"))[-1]
    for suffix, words in {
        "": "",
        "_start": ", at the beginning",
        "_std": ", standard deviation",
    }.items():
        if key.endswith(suffix) and (entry := catalogue().get(key.removesuffix(suffix))):
            text = f"{entry.name}: {entry.meaning}" if entry.meaning else entry.name
            return entry.unit if entry.unit != "1" else "-", _cell(text + words)
    return "", ""


def _cell(text: str) -> str:
    return (
        " ".join(text.split())
        .replace("|", r"\|")
        .replace("<", "&lt;")
        .replace("*", r"\*")
        .replace("[", r"\[")
    )


def _table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (heads, ("---",) * len(heads), *rows)]
