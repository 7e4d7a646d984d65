"""House style, section 1: standard terms in identifiers, and docstrings that open with a verb or a
noun.
"""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator

import pytest

from support.source import PACKAGE, ROOT, Function, exported, faces, functions, modules

WORDS = """
told tells heard hears said says asked wanted lifted shut met spoke silent listened told_of heard_of
said_of nobody somebody somehow whatever whoever begun went goes gone leap stray near led_nowhere
in_time kept_apart laid borne beyond_doubt
"""
FORBIDDEN = set(WORDS.split())
FORBIDDEN_AS_A_WHOLE = {"one", "ones", "each", "thing", "things", "what"}
FUNCTIONS = "of at along beside each places before after below above into onto by"
FORBIDDEN_FUNCTIONS = set(FUNCTIONS.split())
OPENINGS = re.compile(
    r"(?:What|Whether|Where|How|Who|Whom|Whose|Which|Why|When|As|Of|Made|Told|None)\b"
)


def sources() -> Iterator[tuple[str, ast.Module]]:
    """Yield every module of the package, the tests, the benchmarks and the docs programs."""
    for folder in (
        PACKAGE,
        *(ROOT / name for name in ("tests", "benchmarks", "benchmark", "docs")),
    ):
        for name, tree in modules(folder):
            yield f"{folder.name}/{name}", tree


def bound_names(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every name that a module binds: variables, parameters, functions, classes, fields."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.id
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg
        elif isinstance(node, Function | ast.ClassDef):
            yield node.lineno, node.name
        elif isinstance(node, ast.alias) and node.asname:
            yield getattr(node, "lineno", 0), node.asname


def objections(name: str) -> bool:
    """True for a name outside the field's vocabulary."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower().strip("_")
    return words in FORBIDDEN_AS_A_WHOLE or bool(FORBIDDEN & {words, *words.split("_")})


def test_identifiers_are_standard_terms():
    found: dict[str, list[str]] = defaultdict(list)
    for module, tree in sources():
        for line, name in bound_names(tree):
            if objections(name):
                found[module].append(f"{line} {name}")
        for function in functions(tree):
            if module.startswith("asperity/") and function.name.strip("_") in FORBIDDEN_FUNCTIONS:
                found[module].append(f"{function.lineno} {function.name}()")
    listed = [f"{module}: {', '.join(names)}" for module, names in found.items()]
    assert not found, f"{sum(map(len, found.values()))} names\n" + "\n".join(listed)


def test_docstrings_open_with_a_verb_or_a_noun():
    wrong = [
        f"{module}:{getattr(node, 'lineno', 1)} {text.splitlines()[0][:70]}"
        for module, tree in sources()
        for node in ast.walk(tree)
        if isinstance(node, Function | ast.ClassDef | ast.Module)
        and OPENINGS.match(text := ast.get_docstring(node) or "")
    ]
    assert not wrong, f"{len(wrong)} docstrings\n" + "\n".join(wrong)


def test_public_classes_have_names_of_their_own():
    homes: dict[str, set[str]] = defaultdict(set)
    for name, tree in modules():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].add(name)
    shared = {name: places for name, places in homes.items() if len(places) > 1}
    assert not shared


def test_public_names_are_not_shared_by_two_rooms():
    homes: dict[str, set[str]] = defaultdict(set)
    for face, module in faces().items():
        for name, value in exported(module).items():
            if isinstance(value, type) and value.__module__.startswith(f"asperity.{face}"):
                homes[name].add(face)
    assert {name: rooms for name, rooms in homes.items() if len(rooms) > 1} == {}


@pytest.mark.parametrize("name", ["told", "heard_files", "_one", "MOST_TOLD", "HeardSeries"])
def test_words_outside_the_vocabulary_are_found(name):
    assert objections(name)


@pytest.mark.parametrize("name", ["threshold", "one_sided", "nearest", "bone", "metal", "shutdown"])
def test_words_of_the_vocabulary_pass(name):
    assert not objections(name)


def test_minimum_film_is_found_in_code():
    text = "\n".join(path.read_text("utf-8") for path in PACKAGE.rglob("*.py"))
    assert re.search("minimum film", text, re.IGNORECASE)
