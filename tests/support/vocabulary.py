"""Everything that the documentation may name: what is defined in the source, case keys, commands,
JSON keys, files.
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
)  # other people's modules that the docs name
TIMES = {"seconds", "solve_seconds"}  # left out of golden numbers, as no two runs share them
GOLDEN = {  # command: where its JSON lies in the golden numbers
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
    """Names by what they are; `members` has the attributes of each class, those of its bases among
    them.
    """

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
        )  # of functions, and of classes that are called
        self.contents: dict[str, set[str]] = defaultdict(set)  # module, dotted: what it defines
        self.constants: set[str] = set()  # strings in the package's code, docstrings left out
        self.patterns: set[str] = set()  # strings that are put together, as regular expressions
        for folder in FOLDERS:
            for name, tree in modules(folder):
                self._read(
                    ".".join([folder.name, *Path(name).with_suffix("").parts]).removesuffix(
                        ".__init__"
                    ),
                    tree,
                )
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
        """Keys of JSON, of the catalogue of quantities and of columns."""
        from asperity.core.quantities import catalogue

        return TIMES | set(catalogue()) | {key for command in GOLDEN for key in json_keys(command)}

    @cached_property
    def stated(self) -> set[str]:
        """Strings that stand in the code, as they are."""
        return self.constants | self.keys

    def is_written(self, text: str) -> bool:
        """Does the code hold this string, or put it together?"""
        if text in self.stated:
            return True
        if " " in text and any(text in constant for constant in self.constants):
            return True
        return self._put_together.fullmatch(text) is not None

    @cached_property
    def _put_together(self) -> re.Pattern[str]:
        return re.compile("|".join(sorted(self.patterns)))

    def is_name(self, text: str) -> bool:
        """Is this a name without dots that something has?"""
        return text in self.defined or text in self.stated or text in self.module_names

    @cached_property
    def module_names(self) -> set[str]:
        return {part for module in self.contents for part in module.split(".")}

    def resolves(self, dotted: str) -> bool:
        """Does a.b.c lead from a module, a class or an attribute of known type to something that it
        has?
        """
        head, *rest = dotted.split(".")
        if head in ELSEWHERE:
            return _leads_elsewhere(dotted)
        if head in ("asp", "asperity"):
            return self._in_module("asperity", rest)
        homes = [home for home in self.contents if home == head or home.endswith(f".{head}")]
        if any(self._in_module(home, rest) for home in homes):
            return True
        return head in self.defined and self._in_class(self._classes(head), rest)

    def _classes(self, name: str) -> set[str]:
        """The classes that a name stands for: itself, or those that its annotation names."""
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
    """The names that a statement in a module or a class gives to something."""
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
    """Names in an annotation, quoted ones too."""
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


def _leads_elsewhere(dotted: str) -> bool:
    parts = re.sub(r"^np\.", "numpy.", dotted).split(".")
    for split in range(len(parts), 0, -1):
        try:
            thing: Any = importlib.import_module(".".join(parts[:split]))
        except ImportError:
            continue
        for name in parts[split:]:
            thing = getattr(thing, name, None)
        return thing is not None
    return False


@cache
def vocabulary() -> Vocabulary:
    return Vocabulary()


@cache
def golden(command: str) -> tuple[Any, ...]:
    """What a command's JSON was when the golden numbers were taken; nothing for commands that have
    none.
    """
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
    """The commands, each with its parameters."""
    import typer

    from asperity.cli import app

    group: Any = typer.main.get_command(app)
    return {"": group, **group.commands}


def options(command: str) -> dict[str, Any]:
    """What may follow a command: each option by each of its names."""
    own = {
        name: option
        for option in commands()[command].params
        for name in option.opts
        if name.startswith("-")
    }
    return own | {"--help": None}


def metavars() -> set[str]:
    """What usage lines call a value."""
    return {
        p.metavar or p.name.upper()
        for command in commands().values()
        for p in command.params
        if p.name
    }


@cache
def bases_for_keys() -> tuple[Any, ...]:
    """Cases that between them have every kind of table."""
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
    """Does a case have this key? A case refuses keys that it does not know, and says so."""
    from asperity.core.errors import BadInput

    if dotted.startswith(
        "study."
    ):  # a study's table has, beside its own keys, those of what it sweeps
        key = dotted.removeprefix("study.")
        return key in case_sections()["[study]"].model_fields or is_case_key(key) or is_leaf(key)

    if dotted.startswith("machine."):  # in place of the contact that the bases have
        from asperity.case.machines import MACHINES

        return any(
            dotted.removeprefix("machine.") in section.model_fields
            for section, _ in MACHINES.values()
        )

    if dotted.startswith("rating."):  # beside a machine
        return dotted.removeprefix("rating.") in case_sections()["[rating]"].model_fields

    if dotted.partition(".")[0] not in type(bases_for_keys()[0].contents).model_fields:
        return False

    def knows(case: Any) -> bool:
        try:
            case.with_overrides({re.sub(r"\[\d\]$", "", dotted): object()})
        except BadInput as refusal:
            return "is not a known key" not in str(refusal)
        return True

    return any(knows(case) for case in bases_for_keys())


@cache
def is_leaf(word: str) -> bool:
    """Is there a table of the case that has this key?"""
    stated = [tomllib.loads(case.text) for case in bases_for_keys()]
    tables = {
        name for case in stated for name, table in case.items() if isinstance(table, dict)
    } - {"study"}
    return word in case_sections()["[study]"].model_fields or any(
        is_case_key(f"{table}.{word}") for table in tables
    )


def case_sections() -> dict[str, Any]:
    """The tables of a case file as docs/case-file.md calls them, each as the model that reads
    it.
    """
    base = next(
        name for name, tree in modules() if any(_is_class(node, "Section") for node in tree.body)
    )
    section = importlib.import_module(
        "asperity." + base.removesuffix(".py").replace("/", ".")
    ).Section
    importlib.import_module("asperity.case.machines")  # which no other table needs
    paper = bases_for_keys()[0]
    known: dict[str, Any] = {}
    for model in _heirs(section):
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


def _heirs(model: Any) -> Iterator[Any]:
    for heir in model.__subclasses__():
        yield heir
        yield from _heirs(heir)


def toml(text: str) -> dict[str, Any] | None:
    """A piece of a case file, "..." left out; None for what is none."""
    text = re.sub(r",? ?\.\.\.", "", re.sub(r"= \.\.\.", '= ""', text)) if "{" in text else text
    for attempt in (text, re.sub(r"^(\[[\w.]+\]) ", r"\1\n", text), f"value = {text}"):
        try:
            return tomllib.loads(attempt)
        except tomllib.TOMLDecodeError:
            continue
    return None
