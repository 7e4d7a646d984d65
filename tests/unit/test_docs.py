"""Every name, key, file, option and recipe step in README, CONTRIBUTING and docs exists.

A span of code is judged by its shape: a path, a command, an option, a piece of a case file, an expression, a name. What
is none of these must stand in the code as a string, or in `EXCEPTIONS` with its reason.
"""

import ast
import builtins
import re
import shlex
from collections.abc import Iterable, Iterator
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest
from pint import Quantity
from pydantic.fields import FieldInfo

from support.pages import Line, Page, pages, read
from support.source import PACKAGE, ROOT
from support.vocabulary import (
    ELSEWHERE,
    case_sections,
    commands,
    golden,
    is_case_key,
    is_leaf,
    json_keys,
    json_texts,
    metavars,
    options,
    toml,
    vocabulary,
)

EXCEPTIONS = {  # what is right but of none of these kinds
    "CLR 0.822, CAR 0.102, CRF 3711 Hz": "printed, see test_readme",
    "lint-imports": "the command of import-linter",
    "is_...(head)": "of many",
    '["Rx", "Ry"]': "stands for two lengths",
    "ra_m": "put together of the parameter's name and unit",
    "SeedSequence(base seed, realisation, hash of the swept values)": "its arguments in words",
    "linspace(0, fs/2, n/2)": "of another program",
    "rq_m": "the same",
    "milled_1.opd": "among the developers' data",
    "ground_lay.plu": "among the developers' data",
    "build/robustness.csv": "written by a benchmark",
    "bearing.gs": "in somebody's file",
    "2/name": "in somebody's file",
    "acc_g": "in somebody's file",
    "acc [g]": "in somebody's file",
    "8.0 X (100g)": "in somebody's file",
    "sampling rate: 20 kHz": "in somebody's file",
    "acc (m/s²)": "in somebody's file",
    "ring-07.csv.toml": "somebody's file",
    "ring-07.toml": "somebody's file",
}
OF_JSON = {  # what golden numbers do not show of `--json`
    "null": "of JSON itself",
    "seconds": "no two runs share it",
    "alert": "a level that the golden series does not reach",
    "reason": "of a file that is refused",
    "pass": "of a history with flattening, and longer than the golden one",
    "ra_m": "of a profile",
    "rq_m": "of a profile",
    "stribeck": "the section is about two commands",
    "traction": "the section is about two commands",
}
TABLES_BESIDE = {"study": {"rows"}, "run": {"rows"}}  # golden numbers have the table, too
AMOUNT = re.compile(r"[+-]?[\d.]+(?:e[+-]?\d+)? [\w/^ *.]+")
SUFFIXES = "py|pyi|toml|md|csv|json|html|nc|npz|png|pdf|parquet|txt|zarr|sh|css|j2|h5|yaml|x3p|sdf|plu|opd"
A_FILE = re.compile(rf"[\w./*{{}}-]*\.({SUFFIXES})|[\w.*-]+/[\w./*-]*|\.\w+")
PLACEHOLDERS = r"NAME|NNNNNN|CASE_ID"
TREES = ("src", "tests", "docs", "examples", "benchmarks")
IMPORTS = ast.Import | ast.ImportFrom
FREE = {*dir(builtins), *ELSEWHERE, "asp", "Path", "Annotated"}  # names that need no definition of ours
OTHER_TOOLS = ("--nthreads", "-n")  # of dask's worker and of pytest


def judged(text: str, page: Path, headings: tuple[str, ...] = ()) -> str | None:
    """What is wrong with a span of code; None if nothing is."""
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
        return None if is_file(text, page) or vocabulary().is_written(text) else "no such file, and nothing writes one"
    if re.fullmatch(r"\w+", text):
        return None if is_word(text) else "nothing has this name"
    if (table := toml(text.strip("'"))) is not None:
        return wrong_table(table)
    if re.fullmatch(r"'?[\w.[\]]+=.+\.\..+'?", text):
        key = text.strip("'").split("=")[0]
        return None if key == "KEY" or is_case_key(key) else f"{key} is not a key of a case"
    if re.fullmatch(r"\w+(, ?\w+)+", text):
        return next((f"{part}: {wrong}" for part in text.split(",") if (wrong := judged(part.strip(), page))), None)
    if vocabulary().is_written(text):
        return None
    if "..." in text and re.fullmatch(r"[\w.]+", text):
        pattern = text.replace("...", r"\w+")
        return None if any(re.fullmatch(pattern, key) for key in vocabulary().stated) else "no key is like this"
    return wrong_expression(text)


def is_word(text: str) -> bool:
    if text.startswith("_") and any(key.endswith(text) for key in vocabulary().keys):
        return True  # "and their _std"
    is_value = toml(f"value = {text}") is not None
    return is_value or vocabulary().is_name(text) or text in metavars() or text in commands() or is_leaf(text)


def is_file(text: str, page: Path) -> bool:
    """Is it there, from the root, the package, the page's folder; or as a bare name anywhere in the repository?"""
    if text.startswith("."):
        hidden = (ROOT / text).exists() or text in ROOT.joinpath(".gitignore").read_text("utf-8")
        return hidden or is_suffix(text) or vocabulary().is_name(text[1:])  # .gain, of what was named before
    bare = re.sub(r"^DIR/|/$", "", text)
    pattern = re.sub(PLACEHOLDERS, "*", bare)
    if any(any(folder.glob(pattern)) for folder in (ROOT, PACKAGE.parent, PACKAGE, page.parent, ROOT / "tests")):
        return True
    if "/" not in bare:
        return any(any(ROOT.joinpath(tree).rglob(bare)) for tree in TREES) or is_output(bare)
    return all(is_output(part) for part in pattern.split("/"))


def is_suffix(text: str) -> bool:
    return vocabulary().is_written(text) or any(value.endswith(text) for value in vocabulary().constants)


def is_output(name: str) -> bool:
    """Does the code write a file or a folder of this name?"""
    stem, dot, suffix = name.partition(".")
    return (
        "*" in name.replace("*.", "")
        or vocabulary().is_written(name)
        or (vocabulary().is_written(stem.strip("*")) and is_suffix(f"{dot}{suffix}") and bool(suffix))
    )


def wrong_command(text: str) -> str | None:
    """A command, its options and how many values each takes: of a usage line in brackets, or of one to be typed."""
    typed = re.sub(r"\.\.\.|[\[\]]", " ", text) if " [" in text else text
    words = shlex.split(re.sub(r"(\\\||\|) ?-", "-", typed), comments=True)[1:]
    if not words or words[0] == "...":
        return None
    name = words.pop(0) if not words[0].startswith("-") else ""
    if name not in commands():
        return f"there is no command {name}"
    known, arguments = options(name), [p for p in commands()[name].params if p.param_type_name == "argument"]
    given = 0
    while words:
        word, _, value = words.pop(0).partition("=") if words[0].startswith("--") else (words.pop(0), "", "")
        if not word.startswith("-") or re.fullmatch(r"-[\d.]+", word):
            given += 1
            continue
        if word not in known:
            return f"asperity {name} has no option {word}"
        takes = 0 if known[word] is None or known[word].is_flag or value else known[word].nargs
        values = [words.pop(0) for _ in range(min(takes, len(words)))]
        if (len(values) < takes and len(values) + len(words) > 0) or any(value.startswith("--") for value in values):
            return f"{word} of asperity {name} takes a value"
        if word == "--set" and (wrong := wrong_override(values[0])):
            return wrong
    if given and not arguments:
        return f"asperity {name} takes no {given} arguments"
    if name and given > len(arguments) and all(argument.nargs == 1 for argument in arguments):
        return f"asperity {name} takes fewer than {given} arguments"
    return None


def wrong_override(text: str) -> str | None:
    key, equals, value = text.partition("=")
    if not equals:
        return f"{text} sets nothing"
    if key == "KEY" or is_case_key(key):
        return wrong_table(toml(value) or {})
    return f"{key} is not a key of a case"


def wrong_shell(text: str) -> str | None:
    words = shlex.split(text, comments=True)
    if words[0] == "make":
        targets = re.findall(r"^([\w-]+):", ROOT.joinpath("Makefile").read_text("utf-8"), re.MULTILINE)
        return next((f"the Makefile has no target {word}" for word in words[1:] if word not in targets), None)
    if "-m" in words:
        module = words[words.index("-m") + 1]
        known = module in ("pytest", "asperity") or module in vocabulary().contents
        files = (word for word in words if "/" in word and not word.startswith("."))
        return next(
            (f"no {file}" for file in files if not ROOT.joinpath(file).exists()), None if known else "no module"
        )
    if words[0] == "pip":
        extras = re.findall(r"\[(\w+)\]", words[-1])
        project = ROOT.joinpath("pyproject.toml").read_text("utf-8")
        return next((f"there is no extra {extra}" for extra in extras if f"\n{extra} = [" not in project), None)
    return None if words[0] == "source" or vocabulary().resolves(words[-1]) else "no such module"


def wrong_options(text: str, headings: tuple[str, ...]) -> str | None:
    """An option of the command that the section is about, or of any command where it is about none."""
    about = [name for heading in headings for name in re.split(r",? ", heading) if name in commands()]
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
    """A key that a case does not have, or a name that is no choice anywhere."""
    if isinstance(table, dict):
        for key, value in table.items():
            bare = key == "value" and not parents
            if not bare and not (is_case_key(".".join((*parents, key))) or vocabulary().is_name(key)):
                return f"{key} is not a key of a case"
            if wrong := wrong_table(value, parents if bare else (*parents, key)):
                return wrong
    if isinstance(table, list):
        return next((wrong for entry in table if (wrong := wrong_table(entry, parents))), None)
    if isinstance(table, str) and table and not is_choice(table):
        return f'"{table}" is no choice of anything'
    return None


def is_choice(text: str) -> bool:
    """Is this an amount, a choice that the code knows, or a file?"""
    shaped = AMOUNT.fullmatch(text) or A_FILE.fullmatch(text) or text.isdigit()
    return bool(shaped) or vocabulary().is_written(text) or text in metavars()


def wrong_expression(text: str) -> str | None:
    """An expression of Python: what is called, looked up and given by name must be there."""
    source = re.sub(r"\.\.\.(?=[,)\]])", "_", re.sub(r"=\.\.\.", "=_", text)).lstrip(".")
    source = re.sub(r", _\)", ")", source)
    for attempt in (f"({source})", source, f"{source}0", f"def {source}: ...", f"{source} ..."):
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
        return None if is_word(name) else f"nothing is called {name}"
    if isinstance(node, ast.Name) and not (is_word(node.id) or node.id in FREE or len(node.id) <= 2):
        return f"nothing is called {node.id}"
    if isinstance(node, ast.Attribute) and not is_path(ast.unparse(node)):
        return f"{ast.unparse(node)} leads nowhere"
    if isinstance(node, ast.Call):
        name = ast.unparse(node.func).rpartition(".")[2]
        given = {word.arg for word in node.keywords if word.arg}
        if name in known.parameters and (strange := given - known.parameters[name]):
            return f"{name} takes no {', '.join(sorted(strange))}"
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return wrong_table(node.value)
    return None


def is_path(dotted: str) -> bool:
    """Names with dots between: a key of a case, or what the code has."""
    plain = re.sub(r"\[[^]]*\]|\([^()]*\)", "", dotted).lstrip("(")
    return vocabulary().resolves(plain) or is_case_key(plain)


def problems(page: Page) -> Iterator[str]:
    for span in page.spans():
        if wrong := judged(span.text, page.path, span.line.headings):
            yield f"{place(page, span.line)}: `{span.text}`: {wrong}"


def place(page: Page, line: Line) -> str:
    return f"{page.path.relative_to(ROOT) if page.path.is_relative_to(ROOT) else page.path}:{line.number}"


PAGES = pytest.mark.parametrize("page", pages(), ids=lambda page: page.path.relative_to(ROOT).as_posix())


@PAGES
def test_what_a_page_names_exists(page):
    wrong = [line for line in problems(page) if line.split("`")[1] not in EXCEPTIONS]
    assert not wrong, "\n".join(wrong)


@PAGES
def test_links_lead_somewhere(page):
    wrong = [f"{place(page, line)}: {target}" for line, target in page.links() if not leads(page, target)]
    assert not wrong, "\n".join(wrong)


def leads(page: Page, target: str) -> bool:
    if re.match(r"https?://", target):
        return True
    path, _, anchor = target.partition("#")
    file = page.path.parent / path
    if path and not file.exists():
        return False
    return not anchor or anchor in (read(file) if path else page).anchors()


@PAGES
def test_blocks_can_be_run(page):
    wrong = [f"{place(page, line)}: {wrong}" for line, wrong in block_problems(page)]
    assert not wrong, "\n".join(wrong)


def block_problems(page: Page) -> Iterator[tuple[Line, str]]:
    """Commands that the command line would refuse, keys that a case would, names that Python would not find."""
    for block in page.blocks:
        if block.language == "sh":
            typed = (line for line in block.text.splitlines() if line.startswith(("asperity", "make", "python")))
            yield from ((block.line, wrong) for line in typed if (wrong := judged(line, page.path)))
        elif block.language == "toml":
            table = toml(block.text)
            wrong = "not TOML" if table is None else wrong_table({k: v for k, v in table.items() if k != "anchor"})
            if wrong:
                yield block.line, wrong
        elif block.language == "python":
            nodes = list(ast.walk(ast.parse(block.text)))
            bound = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
            bound |= {alias.asname or alias.name for node in nodes if isinstance(node, IMPORTS) for alias in node.names}
            yield from ((block.line, wrong) for node in nodes if (wrong := wrong_in_block(node, bound)))


def wrong_in_block(node: ast.AST, bound: set[str]) -> str | None:
    if isinstance(node, ast.ImportFrom):
        missing = [alias.name for alias in node.names if not vocabulary().resolves(f"{node.module}.{alias.name}")]
        private = node.module.startswith("asperity.") and node.module.count(".") > 1
        return f"{node.module} is no face" if private else f"{node.module} has no {missing[0]}" if missing else None
    if isinstance(node, ast.Attribute):
        head = ast.unparse(node).partition(".")[0]
        if (head in bound and head not in FREE) or not head.isidentifier():
            return None if vocabulary().is_name(node.attr) else f"nothing has {node.attr}"
    named = isinstance(node, ast.Constant) or (isinstance(node, ast.Name) and node.id in bound)
    return None if named else wrong_node(node)


COMMAND_LINE, STUDY = read(ROOT / "docs" / "command-line.md"), read(ROOT / "docs" / "study.md")


def sections(page: Page = COMMAND_LINE) -> dict[str, list[Line]]:
    """The lines of docs/command-line.md by the command that they are about; a study has a page of its own."""
    about: dict[str, list[Line]] = {"study": STUDY.prose}
    for line in page.prose:
        for name in line.headings[1].split(", ") if len(line.headings) > 1 else ():
            about.setdefault(name, []).append(line)
    return {name: lines for name, lines in about.items() if name in commands()}


def test_every_command_has_its_section():
    assert set(sections()) == set(commands()) - {""}


@pytest.mark.parametrize("command", [name for name in sections() if golden(name)])
def test_json_keys_are_those_of_the_golden_numbers(command):
    assert unknown_keys(command, sections()[command]) == []
    words = names_in(line.text for line in sections()[command])
    keys = {key for tree in golden(command) for key in tree} - TABLES_BESIDE.get(command, set())
    assert sorted(key for key in keys if not any(stands_for(word, key) for word in words)) == []


def unknown_keys(command: str, lines: list[Line]) -> list[str]:
    """Names in what is said of `--json` that the command's JSON has nowhere."""
    known = json_keys(command) | json_texts(command) | set(OF_JSON)
    words = names_in(json_lines(lines))
    return sorted(word for word in words if not any(stands_for(word, key) for key in known))


def json_lines(lines: list[Line]) -> Iterator[str]:
    """Paragraphs about `--json`, and the first column of a table of its keys."""
    in_table = False
    for line in lines:
        in_table = (in_table and line.text[:1] in ("", "|")) or line.text == "Keys of `--json`:"
        if in_table:
            yield line.text.split("|")[1] if line.text.startswith("|") else ""
        elif "`--json`" in line.text:
            yield line.text.partition("`--json`")[2]


def names_in(texts: Iterable[str]) -> set[str]:
    spans = (span for text in texts for span in re.findall(r"`([^`]+)`", text))
    return {word for span in spans for word in span.split(", ") if re.fullmatch(r"(\.\.\.)?[a-z_]\w*(\.\.\.)?", word)}


def stands_for(word: str, key: str) -> bool:
    """Is this the key, or with dots for what varies, a pattern of it?"""
    return bool(re.fullmatch(word.replace("...", r"\w*"), key))


CASE_FILE = read(ROOT / "docs" / "case-file.md")


def case_tables() -> dict[str, dict[str, str]]:
    """Key and default, as docs/case-file.md has them: by the heading, or by the kind of surface."""
    tables: dict[str, dict[str, str]] = {}
    columns: list[str] = []
    name = ""
    for line in CASE_FILE.prose:
        kind = re.match(r'`(kind = ".*?"|file = )', line.text)
        heading = line.headings[-1] if line.headings else ""
        name = kind[1] if kind else name if heading == "[surface]" and not line.text.startswith("#") else heading
        table = tables.setdefault(name, {})
        if not line.text.startswith("|"):
            columns = []
            if kind:  # of one without a table, the keys stand in the sentence
                table |= dict.fromkeys(re.findall(r"`(\w+)`", line.text), "")
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.text)[1:-1]]
        if cells[0] == "key":
            columns = cells
        keys = re.findall(r"`(\w+)`", cells[0])
        stated = cells[columns.index("default")] if "default" in columns else ""
        spans = re.findall(r"`([^`]+)`", stated)
        table |= dict(zip(keys, spans if len(spans) == len(keys) else [stated] * len(keys), strict=True))
    return tables


@pytest.mark.parametrize("name", case_sections())
def test_the_case_file_has_every_key_with_its_default(name):
    if name == "[study]":
        pytest.skip("docs/study.md has its keys")
    fields, documented = case_sections()[name].model_fields, case_tables()[name]
    values = {key for key, field in fields.items() if key not in ("kind", "file") and not is_table(name, key)}
    assert set(documented) - {"file", "kind"} == values
    stated = {key: text for key, text in documented.items() if text and text != "as above"}
    wrong = {key: (text, fields[key].default) for key, text in stated.items() if not is_default(text, fields[key])}
    assert wrong == {}


def is_table(name: str, key: str) -> bool:
    return name == "Top level" and (key == "surface" or f"[{key}]" in case_sections())


def is_default(text: str, field: FieldInfo) -> bool:
    """Is this what the model takes where nothing is said?"""
    if field.is_required() or text == "required":
        return field.is_required() and text == "required"
    value = toml(f"value = {text.strip('`')}")
    default = field.default[0] if isinstance(field.default, tuple) else field.default
    if value is None or default is None:
        return value is None and default is None
    if isinstance(value["value"], str) and AMOUNT.fullmatch(value["value"]):
        return float(Quantity(value["value"]).to_base_units().magnitude) == pytest.approx(float(default), rel=1e-12)
    return bool(value["value"] == default)


def test_the_page_of_quantities_is_that_of_the_catalogue():
    script = spec_from_file_location("make_quantities", ROOT / "docs" / "make_quantities.py")
    module = module_from_spec(script)
    script.loader.exec_module(module)
    assert module.PAGE.read_text("utf-8") == module.page(), "make docs writes it anew"


MISTAKES = {
    "a path": ["src/asperity/gone.py", "lubricant/gone.py", "tests/unit/test_gone.py", "never-was.csv", "gone/"],
    "a name": ["solve_contract", "_FIRST_RESORTS", "asp.solve_contract", "test_that_never_was"],
    "an attribute": ["LoadSharing.clr_sold", "asperity.wear.Stage", "convergence.eror", "ehl.solve_contract", ".gian"],
    "a call": ["acceleration(way='exact')", 'contact_resonance(method="peek")', "solve_contract(case)"],
    "elsewhere": ["scipy.signal.freqs_of", "python -m benchmarks.gone", "make tests", "pip install 'asperity[gone]'"],
    "a key of a case": ["vibration.stiffness_laws", "[vibrations]", 'contact.lod = ["1 N"]', "'grid.z[0]=-4..-1'"],
    "a choice": ['method = "peek"', '"hertz-pont"', '{ law = "barrus", eta0 = "1 Pa s" }'],
    "a command": ["asperity trace", "asperity track FILE... [--speeds 3]", "trace --json", "asperity solve a b"],
    "an option": ["--raet", "--set contact.lod=1", "asperity solve --out --json", "asperity solve x --set a=1"],
    "a list": ["car, carr"],
}


@pytest.mark.parametrize(("kind", "text"), [(kind, text) for kind, texts in MISTAKES.items() for text in texts])
def test_a_mistake_of_each_kind_is_seen(kind, text):
    assert judged(text, ROOT / "docs" / "a.md") is not None, kind


def test_a_mistake_is_seen_where_it_stands():
    text = "# T\n\n## track\n\n`--band` or\n`--cells`; [x](gone.md), [y](#gone), [T](#t).\n\n`--json`: `clr`, `crl`.\n"
    page = Page(ROOT / "docs" / "a.md", text)
    assert [line.split(": ")[0] for line in problems(page)] == ["docs/a.md:6", "docs/a.md:8"]
    assert [target for _, target in page.links() if not leads(page, target)] == ["gone.md", "#gone"]
    assert unknown_keys("track", sections(page)["track"]) == ["crl"]


@pytest.mark.parametrize(
    ("language", "text"),
    [
        ("sh", "asperity solve a.toml --lod 3"),
        ("toml", '[contact]\nlod = "3 N"'),
        ("toml", '[contact]\ngeometry = "lien"'),
        ("python", "import asperity as asp\nasp.solve_contract()"),
        ("python", "import asperity as asp\ncase = asp.load_case('a')\ncase.solve_now()"),
        ("python", "from asperity.ehl.solve import solve_contact"),
        ("python", "from asperity.ehl import solve_contract"),
    ],
)
def test_a_mistake_in_a_block_is_seen(language, text):
    page = Page(ROOT / "docs" / "a.md", f"```{language}\n{text}\n```\n")
    assert len(list(block_problems(page))) == 1


def test_every_exception_is_needed():
    spans = {span.text: (page, span) for page in pages() for span in page.spans()}
    assert sorted(EXCEPTIONS.keys() - spans.keys()) == []
    told = ((text, *spans[text]) for text in EXCEPTIONS)
    assert [text for text, page, span in told if judged(text, page.path, span.line.headings) is None] == []
    shown = {word: [name for name in sections() if word in names_in(json_lines(sections()[name]))] for word in OF_JSON}
    assert [w for w, names in shown.items() if all(w in json_keys(n) | json_texts(n) for n in names if golden(n))] == []
