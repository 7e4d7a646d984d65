"""Check the documentation against the code, the command line and the files.

The shape of a code span decides the check: a path, a command, an option, part of a case file, an
expression or a name. Any other span must occur as a string in the package's code.
"""

import ast
import builtins
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

from support.pages import Line, Page, read
from support.source import PACKAGE, ROOT
from support.vocabulary import (
    ELSEWHERE,
    commands,
    is_case_key,
    is_leaf,
    metavars,
    options,
    toml,
    vocabulary,
)

AMOUNT = re.compile(r"[+-]?[\d.]+(?:e[+-]?\d+)? [\w/^ *.]+")
SUFFIXES = (
    "py|pyi|toml|md|csv|json|html|nc|npz|png|pdf|parquet|txt|zarr|sh|css|j2|h5|yaml|x3p|sdf|plu|opd"
)
A_FILE = re.compile(rf"[\w./*{{}}-]*\.({SUFFIXES})|[\w.*-]+/[\w./*-]*|\.\w+")
PLACEHOLDERS = r"NAME|NNNNNN|CASE_ID"
TREES = ("src", "tests", "docs", "examples", "benchmarks", "benchmark")
IMPORTS = ast.Import | ast.ImportFrom
FREE = {
    *dir(builtins),
    *ELSEWHERE,
    "asp",
    "Path",
    "Annotated",
}  # names without a definition in the package
FIGURE_METHODS = {"savefig"}  # of a matplotlib figure, which `plot` of a result returns
OTHER_TOOLS = ("--nthreads", "-n")  # options of dask workers and of pytest


def span_error(text: str, page: Path, headings: tuple[str, ...] = ()) -> str | None:
    """Return the error in a code span, or None."""
    word = text.split(maxsplit=1)[0] if text.strip() else ""
    if word in ("asperity", ".venv/bin/asperity"):
        return wrong_command(text)
    if word in commands() and " -" in text:
        return wrong_command(f"asperity {text}")
    if word in ("make", "python", ".venv/bin/python", "pip", "source", "import"):
        return wrong_shell(text)
    if word.startswith("-"):
        return wrong_options(text, headings)
    if A_FILE.fullmatch(text):
        return (
            None
            if is_file(text, page) or vocabulary().is_written(text)
            else "no such file, and the code writes none"
        )
    if re.fullmatch(r"\w+", text):
        return None if is_word(text) else "unknown name"
    if (table := toml(text.strip("'"))) is not None:
        return wrong_table(table)
    if re.fullmatch(r"'?[\w.[\]]+=.+\.\..+'?", text):
        key = text.strip("'").split("=")[0]
        return None if key == "KEY" or is_case_key(key) else f"{key} is not a key of a case"
    if re.fullmatch(r"\w+(, ?\w+)+", text):
        return next(
            (
                f"{part}: {wrong}"
                for part in text.split(",")
                if (wrong := span_error(part.strip(), page))
            ),
            None,
        )
    if vocabulary().is_written(text):
        return None
    if "..." in text and re.fullmatch(r"[\w.]+", text):
        pattern = text.replace("...", r"\w+")
        return (
            None
            if any(re.fullmatch(pattern, key) for key in vocabulary().stated | vocabulary().defined)
            else "no key matches"
        )
    return wrong_expression(text)


def is_word(text: str) -> bool:
    if text.startswith("_") and any(key.endswith(text) for key in vocabulary().keys):
        return True  # as in "and their _std"
    is_value = toml(f"value = {text}") is not None
    return (
        is_value
        or vocabulary().is_name(text)
        or text in metavars()
        or text in commands()
        or is_leaf(text)
    )


def is_file(text: str, page: Path) -> bool:
    """Return True for a path below the root, the package or the page's folder, or a file name
    anywhere.
    """
    if text.startswith("."):
        hidden = (ROOT / text).exists() or text in ROOT.joinpath(".gitignore").read_text("utf-8")
        return (
            hidden or is_suffix(text) or vocabulary().is_name(text[1:])
        )  # .gain, an attribute of the preceding name
    bare = re.sub(r"^DIR/|/$", "", text)
    pattern = re.sub(PLACEHOLDERS, "*", bare)
    if any(
        any(folder.glob(pattern))
        for folder in (ROOT, PACKAGE.parent, PACKAGE, page.parent, ROOT / "tests")
    ):
        return True
    if "/" not in bare:
        return any(any(ROOT.joinpath(tree).rglob(bare)) for tree in TREES) or is_output(bare)
    return all(is_output(part) for part in pattern.split("/"))


def is_suffix(text: str) -> bool:
    return vocabulary().is_written(text) or any(
        value.endswith(text) for value in vocabulary().constants
    )


def is_output(name: str) -> bool:
    """Return True if the code writes a file or a folder of this name."""
    stem, dot, suffix = name.partition(".")
    return (
        "*" in name.replace("*.", "")
        or vocabulary().is_written(name)
        or (
            vocabulary().is_written(stem.strip("*"))
            and is_suffix(f"{dot}{suffix}")
            and bool(suffix)
        )
    )


def wrong_command(text: str) -> str | None:
    """Check a command, its options and their number of values, in a usage line or a typed
    command.
    """
    typed = re.sub(r"\.\.\.|[\[\]]", " ", text) if " [" in text else text
    words = shlex.split(re.sub(r"(\\\||\|) ?-", "-", typed), comments=True)[1:]
    if not words or words[0] == "...":
        return None
    name = words.pop(0) if not words[0].startswith("-") else ""
    if name not in commands():
        return f"there is no command {name}"
    known, arguments = (
        options(name),
        [p for p in commands()[name].params if p.param_type_name == "argument"],
    )
    given = 0
    while words:
        word, _, value = (
            words.pop(0).partition("=") if words[0].startswith("--") else (words.pop(0), "", "")
        )
        if not word.startswith("-") or re.fullmatch(r"-[\d.]+", word):
            given += 1
            continue
        if word not in known:
            return f"asperity {name} has no option {word}"
        takes = 0 if known[word] is None or known[word].is_flag or value else known[word].nargs
        values = [words.pop(0) for _ in range(min(takes, len(words)))]
        if (len(values) < takes and len(values) + len(words) > 0) or any(
            value.startswith("--") for value in values
        ):
            return f"{word} of asperity {name} takes a value"
        if word == "--set" and name != "check" and (wrong := wrong_override(values[0])):
            return wrong
    if given and not arguments:
        return f"asperity {name} takes no {given} arguments"
    if name and given > len(arguments) and all(argument.nargs == 1 for argument in arguments):
        return f"asperity {name} takes fewer than {given} arguments"
    return None


def wrong_override(text: str) -> str | None:
    key, equals, value = text.partition("=")
    if not equals:
        return f"{text} has no value"
    if key == "KEY" or is_case_key(key):
        return wrong_table(toml(value) or {})
    return f"{key} is not a key of a case"


def wrong_shell(text: str) -> str | None:
    words = shlex.split(text, comments=True)
    if words[0] == "make":
        targets = re.findall(
            r"^([\w-]+):", ROOT.joinpath("Makefile").read_text("utf-8"), re.MULTILINE
        )
        return next(
            (f"the Makefile has no target {word}" for word in words[1:] if word not in targets),
            None,
        )
    if "-m" in words:
        module = words[words.index("-m") + 1]
        known = (
            module in ("pytest", "asperity")
            or {module, f"tests.{module}"} & vocabulary().contents.keys()
        )
        files = (word for word in words if "/" in word and not word.startswith("."))
        return next(
            (f"no {file}" for file in files if not ROOT.joinpath(file).exists()),
            None if known else "no module",
        )
    if words[0] == "pip":
        extras = re.findall(r"\[(\w+)\]", words[-1])
        project = ROOT.joinpath("pyproject.toml").read_text("utf-8")
        return next(
            (f"there is no extra {extra}" for extra in extras if f"\n{extra} = [" not in project),
            None,
        )
    return None if words[0] == "source" or vocabulary().resolves(words[-1]) else "no such module"


def wrong_options(text: str, headings: tuple[str, ...]) -> str | None:
    """Check options against the commands in the section's heading, or against all commands."""
    about = [
        name for heading in headings for name in re.split(r",? ", heading) if name in commands()
    ]
    words = re.findall(r"(?<!\S)--?[a-z][\w-]*", text)
    for word in words:
        if word in OTHER_TOOLS:
            continue
        if not any(word in options(name) for name in about or commands()):
            return f"{' nor '.join(about) or 'no command'} has no option {word}"
    for setting in re.findall(r"--set ([^-][^=]*=.*)", text):
        if wrong := wrong_override(shlex.split(setting)[0]):
            return wrong
    return None


def wrong_table(table: object, parents: tuple[str, ...] = ()) -> str | None:
    """Check a table for unknown keys and unknown choices."""
    if isinstance(table, dict):
        for key, value in table.items():
            bare = key == "value" and not parents
            if not bare and not (
                is_case_key(".".join((*parents, key))) or vocabulary().is_name(key)
            ):
                return f"{key} is not a key of a case"
            if wrong := wrong_table(value, parents if bare else (*parents, key)):
                return wrong
    if isinstance(table, list):
        return next((wrong for entry in table if (wrong := wrong_table(entry, parents))), None)
    if isinstance(table, str) and table and not is_choice(table):
        return f'"{table}" is not a choice of any key'
    return None


def is_choice(text: str) -> bool:
    """Return True for an amount, a choice in the code, or a file."""
    shaped = AMOUNT.fullmatch(text) or A_FILE.fullmatch(text) or text.isdigit()
    return (
        bool(shaped)
        or vocabulary().is_written(text)
        or text in metavars()
        or text[0] == "["
        or is_case_key(text)
    )


def wrong_expression(text: str) -> str | None:
    """Check an expression of Python: calls, attributes and keyword arguments must exist."""
    source = re.sub(r"\.\.\.(?=[,)\]])", "_", re.sub(r"=\.\.\.", "=_", text)).lstrip(".")
    source = re.sub(r", _\)", ")", source)
    for attempt in (
        f"({source})",
        source,
        f"{source}0",
        f"dict({source})",
        f"def {source}: ...",
        f"{source} ...",
    ):
        try:
            tree = ast.parse(attempt)
        except SyntaxError:
            continue
        return next((wrong for node in ast.walk(tree) if (wrong := wrong_node(node))), None)
    return "neither a file, a command, a key, a name nor an expression"


def wrong_node(node: ast.AST) -> str | None:
    known = vocabulary()
    if isinstance(node, ast.FunctionDef | ast.arg):
        name = node.name if isinstance(node, ast.FunctionDef) else node.arg
        return None if is_word(name) else f"unknown name {name}"
    if isinstance(node, ast.Name) and not (
        is_word(node.id) or node.id in FREE or len(node.id) <= 2
    ):
        return f"unknown name {node.id}"
    if isinstance(node, ast.Attribute) and not is_path(ast.unparse(node)):
        return f"{ast.unparse(node)} does not resolve"
    if isinstance(node, ast.Call):
        name = ast.unparse(node.func).rpartition(".")[2]
        given = {word.arg for word in node.keywords if word.arg}
        if name in known.parameters and (strange := given - known.parameters[name]):
            return f"{name} takes no {', '.join(sorted(strange))}"
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return wrong_table(node.value)
    return None


def is_path(dotted: str) -> bool:
    """Return True for a dotted name that is a key of a case or exists in the code."""
    plain = re.sub(r"\[[^]]*\]|\([^()]*\)", "", dotted).lstrip("(")
    return vocabulary().resolves(plain) or is_case_key(plain)


def problems(page: Page) -> Iterator[str]:
    for span in page.spans():
        if wrong := span_error(span.text, page.path, span.line.headings):
            yield f"{location(page, span.line)}: `{span.text}`: {wrong}"


def location(page: Page, line: Line) -> str:
    path = page.path.relative_to(ROOT) if page.path.is_relative_to(ROOT) else page.path
    return f"{path}:{line.number}"


def link_resolves(page: Page, target: str) -> bool:
    if re.match(r"https?://", target):
        return True
    path, _, anchor = target.partition("#")
    file = page.path.parent / path
    if path and not file.exists():
        return False
    return not anchor or anchor in (read(file) if path else page).anchors()


def block_problems(page: Page) -> Iterator[tuple[Line, str]]:
    """Yield commands, case keys and Python names in fenced blocks that the package would refuse."""
    for block in page.blocks:
        if block.language == "sh":
            typed = (
                line
                for line in block.text.splitlines()
                if line.startswith(("asperity", "make", "python"))
            )
            yield from (
                (block.line, wrong) for line in typed if (wrong := span_error(line, page.path))
            )
        elif block.language == "toml":
            table = toml(block.text)
            wrong = (
                "not TOML"
                if table is None
                else wrong_table({k: v for k, v in table.items() if k != "anchor"})
            )
            if wrong:
                yield block.line, wrong
        elif block.language == "python":
            nodes = list(ast.walk(ast.parse(block.text)))
            bound = {
                node.id
                for node in nodes
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
            }
            bound |= {
                alias.asname or alias.name
                for node in nodes
                if isinstance(node, IMPORTS)
                for alias in node.names
            }
            yield from (
                (block.line, wrong) for node in nodes if (wrong := wrong_in_block(node, bound))
            )


def wrong_in_block(node: ast.AST, bound: set[str]) -> str | None:
    if isinstance(node, ast.ImportFrom):
        missing = [
            alias.name
            for alias in node.names
            if not vocabulary().resolves(f"{node.module}.{alias.name}")
        ]
        private = node.module.startswith("asperity.") and node.module.count(".") > 1
        return (
            f"{node.module} is not public"
            if private
            else f"{node.module} has no {missing[0]}"
            if missing
            else None
        )
    if isinstance(node, ast.Attribute):
        head = ast.unparse(node).partition(".")[0]
        if (head in bound and head not in FREE) or not head.isidentifier():
            known = node.attr in FIGURE_METHODS or vocabulary().is_name(node.attr)
            return None if known else f"no object has {node.attr}"
    named = isinstance(node, ast.Constant) or (isinstance(node, ast.Name) and node.id in bound)
    return None if named else wrong_node(node)
