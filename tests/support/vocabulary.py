"""Names that the documentation may use: definitions in the source, case keys, commands, JSON keys
and files.
"""

import ast
import importlib
import json
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import Any, get_args

from support.source import PACKAGE, ROOT, Function, functions, modules

FOLDERS = (PACKAGE, ROOT / "tests", ROOT / "benchmarks", ROOT / "benchmark")
ELSEWHERE = (
    "scipy",
    "numpy",
    "np",
    "concurrent",
    "itertools",
    "pathlib",
)  # third-party modules that the docs name
# not in the golden numbers, because they differ from run to run
TIMES = {"seconds", "solve_seconds"}
GOLDEN = {  # command: location of its JSON in the golden numbers
    "solve": [
        (name,)
        for name in (
            "paper",
            "smooth",
            "printed-preset",
            "conserving",
            "dry",
            "tangent",
            "warm",
            "ball",
            "ellipse",
        )
    ],
    "stribeck": [("curves", "stribeck")],
    "traction": [("curves", "traction")],
    "vibrate": [("vibrate", name) for name in ("sound", "paper", "nonlinear", "table1")],
    "surface": [("surface", "plain"), ("surface", "filtered")],
    "check": [("track", "check")],
    "track": [("track", "track")],
    "rig": [("track", "rig")],
    "study": [("study",)],
    "run": [("history",), ("history-conserving",)],
}


class Vocabulary:
    """Names by kind; `members` returns the attributes of a class, including those of its bases."""

    def __init__(self) -> None:
        self.defined: set[str] = (
            set()
        )  # functions, classes, attributes, module constants, parameters
        self.own_members: dict[str, set[str]] = defaultdict(set)
        self.bases: dict[str, set[str]] = defaultdict(set)
        self.types: dict[str, set[str]] = defaultdict(
            set
        )  # attribute or function: classes named in its annotation
        self.parameters: dict[str, set[str]] = defaultdict(
            set
        )  # parameters of functions, and of classes that are called
        self.contents: dict[str, set[str]] = defaultdict(set)  # dotted module: its definitions
        self.constants: set[str] = set()  # strings in the package's code, without docstrings
        self.patterns: set[str] = set()  # f-strings as regular expressions
        for folder in FOLDERS:
            for name, tree in modules(folder):
                self._read(
                    ".".join([folder.name, *Path(name).with_suffix("").parts]).removesuffix(
                        ".__init__"
                    ),
                    tree,
                )
        self.constants |= {path.stem for path in PACKAGE.glob("structure/machines/*.toml")}
        for stub in PACKAGE.rglob("*.pyi"):
            folder = ".".join(("asperity", *stub.parent.relative_to(PACKAGE).parts))
            for node in ast.parse(stub.read_text("utf-8")).body:
                if isinstance(node, ast.ImportFrom):
                    self.contents[folder] |= {alias.asname or alias.name for alias in node.names}

    def _read(self, module: str, tree: ast.Module) -> None:
        parent, _, own = module.rpartition(".")
        self.contents[parent].add(own)
        for node in tree.body:
            self.contents[module] |= _bound(node)
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                self._read_class(node)
        for function in functions(tree):
            self._read_function(function)
        self.defined |= self.contents[module]
        if module.startswith("asperity"):
            self._read_strings(tree)

    def _read_class(self, node: ast.ClassDef) -> None:
        self.bases[node.name] |= {word for base in node.bases for word in _words(base)}
        members = {name for entry in node.body for name in _bound(entry)}
        for entry in node.body:
            if isinstance(entry, ast.AnnAssign) and isinstance(entry.target, ast.Name):
                self.types[entry.target.id] |= _words(entry.annotation)
        for inner in ast.walk(node):
            if (
                isinstance(inner, ast.Attribute)
                and isinstance(inner.ctx, ast.Store)
                and _is_self(inner.value)
            ):
                members.add(inner.attr)
        self.own_members[node.name] |= members
        self.parameters[node.name] |= members
        self.defined |= members | {node.name}

    def _read_function(self, function: Function) -> None:
        arguments = function.args
        entries = (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
        names = {entry.arg for entry in entries}
        for entry in entries:
            if entry.annotation is not None:
                self.types[entry.arg] |= _words(entry.annotation)
        self.parameters[function.name] |= names - {"self", "cls"}
        self.defined |= names | {function.name}
        if function.returns is not None:
            self.types[function.name] |= _words(function.returns)

    def _read_strings(self, tree: ast.Module) -> None:
        described = {id(node.body[0].value) for node in ast.walk(tree) if _has_docstring(node)}
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and id(node) not in described
            ):
                self.constants.add(node.value)
            elif isinstance(node, ast.JoinedStr):
                parts = [
                    re.escape(p.value) if isinstance(p, ast.Constant) else r"[\w.-]+"
                    for p in node.values
                ]
                fixed = (
                    re.sub(r"\.\w+$", "", p.value)
                    for p in node.values
                    if isinstance(p, ast.Constant)
                )
                if any(re.search("[a-z]{3}", part, re.IGNORECASE) for part in fixed):
                    self.patterns.add("".join(parts))

    def members(self, name: str) -> set[str]:
        inherited = (self.members(base) for base in self.bases.get(name, ()) if base != name)
        return set(self.own_members.get(name, ())).union(*inherited)

    @cached_property
    def keys(self) -> set[str]:
        """Keys of JSON, of the catalogue of quantities and of table columns."""
        from asperity.core.quantities import catalogue

        return TIMES | set(catalogue()) | {key for command in GOLDEN for key in json_keys(command)}

    @cached_property
    def stated(self) -> set[str]:
        """String constants in the code and keys."""
        return self.constants | self.keys

    def is_written(self, text: str) -> bool:
        """Return True if the code contains this string or can format it."""
        if text in self.stated:
            return True
        if " " in text and any(text in constant for constant in self.constants):
            return True
        return self._formatted.fullmatch(text) is not None

    @cached_property
    def _formatted(self) -> re.Pattern[str]:
        return re.compile("|".join(sorted(self.patterns)))

    def is_name(self, text: str) -> bool:
        """Return True for a defined name without dots."""
        return text in self.defined or text in self.stated or text in self.module_names

    @cached_property
    def module_names(self) -> set[str]:
        return {part for module in self.contents for part in module.split(".")}

    def resolves(self, dotted: str) -> bool:
        """Return True if a.b.c resolves from a module, a class or an attribute of known type."""
        head, *rest = dotted.split(".")
        if head in ELSEWHERE:
            return _resolves_externally(dotted)
        if head in ("asp", "asperity"):
            return self._in_module("asperity", rest)
        homes = [home for home in self.contents if home == head or home.endswith(f".{head}")]
        if any(self._in_module(home, rest) for home in homes):
            return True
        return head in self.defined and self._in_class(self._classes(head), rest)

    def _classes(self, name: str) -> set[str]:
        """Return the classes that a name denotes: itself, or those in its annotation."""
        return (
            {name}
            if name in self.own_members
            else {word for word in self.types[name] if word in self.own_members}
        )

    def _in_class(self, classes: set[str], rest: list[str]) -> bool:
        if not rest:
            return True
        have = {name for name in classes if rest[0] in self.members(name)}
        return bool(have) and (len(rest) == 1 or self._in_class(self._classes(rest[0]), rest[1:]))

    def _in_module(self, home: str, rest: list[str]) -> bool:
        if not rest:
            return True
        if f"{home}.{rest[0]}" in self.contents and self._in_module(f"{home}.{rest[0]}", rest[1:]):
            return True
        return rest[0] in self.contents[home] and self._in_class(self._classes(rest[0]), rest[1:])


def _bound(node: ast.stmt) -> set[str]:
    """Return the names that a statement in a module or a class defines."""
    if isinstance(node, Function | ast.ClassDef):
        return {node.name}
    if isinstance(node, ast.Assign):
        return {
            name.id
            for target in node.targets
            for name in ast.walk(target)
            if isinstance(name, ast.Name)
        }
    if isinstance(node, ast.AnnAssign):
        return {node.target.id} if isinstance(node.target, ast.Name) else set()
    return set()


def _words(annotation: ast.expr) -> set[str]:
    """Return the names in an annotation, including quoted ones."""
    nodes = list(ast.walk(annotation))
    quoted = " ".join(
        node.value
        for node in nodes
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
    named = {
        node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "") for node in nodes
    }
    return named | set(re.findall(r"\w+", quoted))


def _is_self(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "self"


def _has_docstring(node: ast.AST) -> bool:
    return (
        isinstance(node, Function | ast.ClassDef | ast.Module)
        and ast.get_docstring(node) is not None
    )


def _resolves_externally(dotted: str) -> bool:
    parts = re.sub(r"^np\.", "numpy.", dotted).split(".")
    for split in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:split]))
        except ImportError:
            continue
        for name in parts[split:]:
            found = getattr(found, name, None)
        return found is not None
    return False


@cache
def vocabulary() -> Vocabulary:
    return Vocabulary()


@cache
def golden(command: str) -> tuple[Any, ...]:
    """Return a command's JSON in the golden numbers; empty for commands without it."""
    trees = []
    for name, *inside in GOLDEN.get(command, ()):
        tree = json.loads(
            (ROOT / "tests" / "reference" / "golden" / f"{name}.json").read_text("utf-8")
        )
        for key in inside:
            tree = tree[key]
        trees.append(tree)
    return tuple(trees)


def json_keys(command: str) -> set[str]:
    return {word for tree in golden(command) for word, is_key in _tree_words(tree) if is_key}


def json_texts(command: str) -> set[str]:
    return {word for tree in golden(command) for word, is_key in _tree_words(tree) if not is_key}


def _tree_words(tree: Any) -> Iterator[tuple[str, bool]]:
    if isinstance(tree, dict):
        yield from ((key, True) for key in tree)
    for inner in (
        tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ()
    ):
        yield from _tree_words(inner)
    if isinstance(tree, str):
        yield tree, False


@cache
def commands() -> dict[str, Any]:
    """Return the commands with their parameters."""
    import typer

    from asperity.cli import app

    group: Any = typer.main.get_command(app)
    return {"": group, **group.commands}


def options(command: str) -> dict[str, Any]:
    """Return the options of a command under each of their names."""
    own = {
        name: option
        for option in commands()[command].params
        for name in option.opts
        if name.startswith("-")
    }
    return own | {"--help": None}


def metavars() -> set[str]:
    """Return the names of values in usage lines."""
    return {
        p.metavar or p.name.upper()
        for command in commands().values()
        for p in command.params
        if p.name
    }


@cache
def bases_for_keys() -> tuple[Any, ...]:
    """Return cases that together contain every kind of table."""
    from asperity.case import load_case

    paper = load_case(ROOT / "examples" / "paper.toml")
    return (
        paper,
        paper.with_overrides({"surface": "flat"}),
        *(paper.with_overrides({"surface": table}) for table in _SURFACE_TABLES),
        *(paper.with_overrides({"lubricant.friction": table}) for table in _FRICTION_TABLES),
        paper.with_overrides(
            {"lubricant.viscosity.law": "roelands", "lubricant.rheology": _EYRING}
        ),
        paper.with_overrides({"thermal.warmth": {"law": "roelands", "s0": 1.1}, "motion.steps": 2}),
        paper.with_overrides({"lubricant": {"grade": "VG 100", "temperature": "70 degC"}}),
        paper.with_overrides({"study": {"sq": ["1 um"]}}),
    )


_EYRING = {"law": "ree-eyring", "tau0": "5 MPa"}
_FRICTION_TABLES = (_EYRING, {"law": "bair-winer-linear", "tau_l0": "5 MPa", "slope": 0.05})
_ROUGH = {"sq": "1 um", "correlation_length": "40 um"}
_SURFACE_TABLES = (
    {"kind": "non-gaussian", "skewness": -0.5, "kurtosis": 3.5, **_ROUGH},
    {"kind": "run-in", "plateau_share": 0.5, **_ROUGH},
    {"kind": "self-affine", "sq": "1 um", "hurst": 0.8, "cutoffs": ["10 um", "100 um"]},
    {"kind": "ground", "sq": "1 um", "groove_width": "40 um", "groove_length": "150 um"},
    {"kind": "sandblasted", "sq": "1 um", "crater_radius": "40 um"},
    {"file": str(ROOT / "tests" / "support" / "map.txt"), "second": {"file": "other.txt"}},
)


@cache
def is_case_key(dotted: str) -> bool:
    """Return True for a key of a case; a case refuses unknown keys."""
    from asperity.core.errors import BadInput

    if dotted.startswith(
        "study."
    ):  # the table of a study has its own keys and those of the swept values
        key = dotted.removeprefix("study.")
        return key in case_sections()["[study]"].model_fields or is_case_key(key) or is_leaf(key)

    if dotted.startswith("machine."):  # a machine replaces the contact of the base cases
        from asperity.case.machines import MACHINES

        return any(
            dotted.removeprefix("machine.") in section.model_fields
            for section, _ in MACHINES.values()
        )

    if dotted.startswith("rating."):  # used with a machine
        return dotted.removeprefix("rating.") in case_sections()["[rating]"].model_fields

    if dotted.partition(".")[0] not in type(bases_for_keys()[0].contents).model_fields:
        return False

    def accepts(case: Any) -> bool:
        try:
            case.with_overrides({re.sub(r"\[\d\]$", "", dotted): object()})
        except BadInput as refusal:
            return "is not a known key" not in str(refusal)
        return True

    return any(accepts(case) for case in bases_for_keys())


@cache
def is_leaf(word: str) -> bool:
    """Return True if a table of the case has this key."""
    stated = [tomllib.loads(case.text) for case in bases_for_keys()]
    tables = {
        name for case in stated for name, table in case.items() if isinstance(table, dict)
    } - {"study"}
    return word in case_sections()["[study]"].model_fields or any(
        is_case_key(f"{table}.{word}") for table in tables
    )


def case_sections() -> dict[str, Any]:
    """Return the tables of a case file under their names in docs/case-file.md, with the model of
    each.
    """
    base = next(
        name for name, tree in modules() if any(_is_class(node, "Section") for node in tree.body)
    )
    section = importlib.import_module(
        "asperity." + base.removesuffix(".py").replace("/", ".")
    ).Section
    importlib.import_module("asperity.case.machines")  # no other table imports it
    paper = bases_for_keys()[0]
    known: dict[str, Any] = {}
    for model in _subclasses(section):
        fields = model.model_fields
        if "kind" in fields and (kinds := get_args(fields["kind"].annotation)) and len(kinds) == 1:
            known[f'kind = "{kinds[0]}"'] = model
        elif {"file", "second"} <= set(fields):
            known["file = "] = model
        elif (name := model.__name__.lower().removesuffix("section")) in (
            *type(paper.contents).model_fields,
            "rating",
        ):
            known[f"[{name}]"] = model
        elif "contact" in fields:
            known["Top level"] = model
        elif "grade" in fields:
            known["An oil by its data sheet"] = model
        elif "design_load" in fields:
            known["The shape of a roller"] = model
    return known


def _is_class(node: ast.stmt, name: str) -> bool:
    return isinstance(node, ast.ClassDef) and node.name == name


def _subclasses(model: Any) -> Iterator[Any]:
    for subclass in model.__subclasses__():
        yield subclass
        yield from _subclasses(subclass)


def toml(text: str) -> dict[str, Any] | None:
    """Parse part of a case file without "..."; return None if it is not TOML."""
    text = re.sub(r",? ?\.\.\.", "", re.sub(r"= \.\.\.", '= ""', text)) if "{" in text else text
    for attempt in (text, re.sub(r"^(\[[\w.]+\]) ", r"\1\n", text), f"value = {text}"):
        try:
            return tomllib.loads(attempt)
        except tomllib.TOMLDecodeError:
            continue
    return None
