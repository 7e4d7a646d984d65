"""Every name, key, file, option and recipe step in README, CONTRIBUTING and docs exists.

`support.judging` defines how a code span is checked; `EXCEPTIONS` lists valid spans of no known
kind.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest
from pint import Quantity
from pydantic.fields import FieldInfo

from asperity.core.quantities import catalogue
from support.judging import AMOUNT, block_problems, link_resolves, location, problems, span_error
from support.pages import Line, Page, pages, read
from support.source import PACKAGE, ROOT, functions, modules, parsed
from support.vocabulary import case_sections, commands, golden, json_keys, json_texts, toml

EXCEPTIONS = {  # valid spans of no known kind
    "CLR 0.786, CAR 0.098, CRF 3684 Hz": "printed, see test_readme",
    "lint-imports": "the command of import-linter",
    "is_...(head)": "a pattern for several functions",
    '["Rx", "Ry"]': "stands for two lengths",
    "linspace(0, fs/2, n/2)": "code of another program",
    "milled_1.opd": "a file of the developers' data",
    "ground_lay.plu": "a file of the developers' data",
    "build/robustness.csv": "written by a benchmark",
    "bearing.gs": "content of a user's file",
    "acc_g": "content of a user's file",
    "acc [g]": "content of a user's file",
    "8.0 X (100g)": "content of a user's file",
    "sampling rate: 20 kHz": "content of a user's file",
    "acc (m/s²)": "content of a user's file",
    "ring-07.csv.toml": "a user's file",
    "ring-07.toml": "a user's file",
    "NAME-85mm.pdf": "NAME is that of the picture, see test_report_layout",
    "NAME-175mm.pdf": "NAME is that of the picture, see test_report_layout",
}
JSON_EXCEPTIONS = {  # `--json` keys and values missing from the golden numbers
    "null": "a JSON literal",
    "seconds": "differs between runs",
    "detects": "several sensors only",
    "alert": "a state that the golden series does not reach",
    "blind": "a state that the golden series does not reach",
    "reason": "refused files only",
    "pass": "long histories with flattening only",
    "whole": "data sets only",
    "title": "data sets only",
    "maps": "data sets only",
    "ra_m": "profiles only",
    "rq_m": "profiles only",
    "letter": "profiles only",
    "stribeck": "the section covers two commands",
    "traction": "the section covers two commands",
}
TABLE_KEYS = {"study": {"rows"}, "run": {"rows"}}  # golden numbers include the table
PAGES = pytest.mark.parametrize(
    "page", pages(), ids=lambda page: page.path.relative_to(ROOT).as_posix()
)


@PAGES
def test_names_on_a_page_exist(page):
    wrong = [line for line in problems(page) if line.split("`")[1] not in EXCEPTIONS]
    assert not wrong, "\n".join(wrong)


@PAGES
def test_links_resolve(page):
    defects = [
        f"{location(page, line)}: {target}"
        for line, target in page.links()
        if not link_resolves(page, target)
    ]
    assert not defects, "\n".join(defects)


@PAGES
def test_the_text_of_a_link_is_not_a_file_name(page):
    defects = [f"{location(page, line)}: {text}" for line, text in named_by_file(page)]
    assert not defects, "\n".join(defects)


@PAGES
def test_blocks_can_be_run(page):
    defects = [f"{location(page, line)}: {defects}" for line, defects in block_problems(page)]
    assert not defects, "\n".join(defects)


def named_by_file(page: Page) -> Iterator[tuple[Line, str]]:
    """Links whose text is the name of a file, which says nothing about its content."""
    for line in page.prose:
        yield from (
            (line, text) for text in re.findall(r"\[(`?[\w/.-]+\.[a-z]{2,4}`?)\]\(", line.text)
        )


def test_a_link_text_that_is_a_file_name_is_detected(tmp_path):
    path = tmp_path / "page.md"
    path.write_text("see [theory/wear.md](theory/wear.md) and [wear](theory/wear.md)", "utf-8")
    assert [text for _, text in named_by_file(read(path))] == ["theory/wear.md"]


COMMAND_LINE, STUDY = read(ROOT / "docs" / "command-line.md"), read(ROOT / "docs" / "study.md")


def sections(page: Page = COMMAND_LINE) -> dict[str, list[Line]]:
    """Lines of docs/command-line.md by command; `study` has a page of its own."""
    by_command: dict[str, list[Line]] = {"study": STUDY.prose}
    for line in page.prose:
        for name in line.headings[1].split(", ") if len(line.headings) > 1 else ():
            by_command.setdefault(name, []).append(line)
    return {name: lines for name, lines in by_command.items() if name in commands()}


def test_every_command_has_its_section():
    assert set(sections()) == set(commands()) - {""}


@pytest.mark.parametrize("command", [name for name in sections() if golden(name)])
def test_json_keys_are_those_of_the_golden_numbers(command):
    assert unknown_keys(command, sections()[command]) == []
    texts = [line.text for line in sections()[command]]
    words = names_in(texts) | (
        set(catalogue()) if any("](quantities.md)" in text for text in texts) else set()
    )
    keys = {key for tree in golden(command) for key in tree} - TABLE_KEYS.get(command, set())
    assert sorted(key for key in keys if not any(matches_key(word, key) for word in words)) == []


def unknown_keys(command: str, lines: list[Line]) -> list[str]:
    """Names in descriptions of `--json` that the command's JSON lacks."""
    known = json_keys(command) | json_texts(command) | set(JSON_EXCEPTIONS)
    words = names_in(json_lines(lines))
    return sorted(word for word in words if not any(matches_key(word, key) for key in known))


def json_lines(lines: list[Line]) -> Iterator[str]:
    """Text after `--json` in each line."""
    return (line.text.partition("`--json`")[2] for line in lines if "`--json`" in line.text)


def names_in(texts: Iterable[str]) -> set[str]:
    spans = (span for text in texts for span in re.findall(r"`([^`]+)`", text))
    return {
        word
        for span in spans
        for word in span.split(", ")
        if re.fullmatch(r"(\.\.\.)?[a-z_]\w*(\.\.\.)?", word)
    }


def matches_key(word: str, key: str) -> bool:
    """Return whether `word` is the key or a pattern of it, with dots for the variable part."""
    return bool(re.fullmatch(word.replace("...", r"\w*"), key))


CONTRIBUTING, ARCHITECTURE = read(ROOT / "CONTRIBUTING.md"), read(ROOT / "docs" / "architecture.md")
CASE_FILE = read(ROOT / "docs" / "case-file.md")


IN_STUDY = {"[study]": "What is swept"}  # heading of its table in docs/study.md


def case_tables() -> dict[str, dict[str, str]]:
    """Keys and defaults in docs/case-file.md by heading or kind of surface."""
    tables: dict[str, dict[str, str]] = {}
    columns: list[str] = []
    name = ""
    for line in (*CASE_FILE.prose, *STUDY.prose):
        kind = re.match(r'`(kind = ".*?"|file = )', line.text)
        heading = line.headings[-1] if line.headings else ""
        name = (
            kind[1]
            if kind
            else (
                line.text.lstrip("# ")
                if line.text.startswith("#")
                else name
                if heading in ("[surface]", "[machine]", "[cycle]")
                else heading
            )
        )
        table = tables.setdefault(name, {})
        if not line.text.startswith("|"):
            columns = []
            if kind:  # a kind without a table lists its keys in the sentence
                table |= dict.fromkeys(re.findall(r"`(\w+)`", line.text), "")
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.text)[1:-1]]
        if cells[0] == "key":
            columns = cells
        keys = re.findall(r"`(\w+)`", cells[0])
        stated = cells[columns.index("default")] if "default" in columns else ""
        spans = re.findall(r"`([^`]+)`", stated)
        table |= dict(
            zip(keys, spans if len(spans) == len(keys) else [stated] * len(keys), strict=True)
        )
    return tables


@pytest.mark.parametrize("name", case_sections())
def test_the_case_file_has_every_key_with_its_default(name):
    fields, documented = case_sections()[name].model_fields, case_tables()[IN_STUDY.get(name, name)]
    values = {
        key for key in fields if key not in ("kind", "file", "axes") and not is_table(name, key)
    }
    if name != "[surface]":
        values -= {"second"}  # common to all surfaces, documented once
    assert set(documented) - {"file", "kind"} == values
    stated = {key: text for key, text in documented.items() if text and text != "as above"}
    wrong = {
        key: (text, fields[key].default)
        for key, text in stated.items()
        if not is_default(text, fields[key])
    }
    assert wrong == {}


def is_table(name: str, key: str) -> bool:
    return name == "Top level" and (key in ("surface", "cycle") or f"[{key}]" in case_sections())


def is_default(text: str, field: FieldInfo) -> bool:
    """Return whether `text` states the default of the field."""
    if field.is_required() or text == "required":
        return field.is_required() and text == "required"
    value = toml(f"value = {text.strip('`')}")
    default = field.default[0] if isinstance(field.default, tuple) else field.default
    if value is None or default is None:
        return value is None and default is None
    if isinstance(value["value"], str) and AMOUNT.fullmatch(value["value"]):
        return float(Quantity(value["value"]).to_base_units().magnitude) == pytest.approx(
            float(default), rel=1e-12
        )
    return bool(value["value"] == default)


@PAGES
def test_named_tests_are_in_the_named_files(page):
    for line in page.prose:
        spans = re.findall(r"`(?:[\w/]*/)?(test_\w+(?:\.py)?)`", line.text)
        files = [
            file for name in spans if name.endswith(".py") for file in ROOT.glob(f"tests/*/{name}")
        ]
        defined = {function.name for file in files for function in functions(parsed(file))}
        named = {name for name in spans if not name.endswith(".py")}
        assert not files or named <= defined, location(page, line)


def test_every_validation_is_documented():
    text = "".join(page.text for page in pages() if page.path.parent.name in ("docs", "theory"))
    tests = sorted(path.name for path in (ROOT / "tests" / "validation").glob("test_*.py"))
    assert len(tests) > 20
    assert [name for name in tests if f"{name}`" not in text] == []


def test_names_in_docstrings_exist():
    """In the package; names local to the same function are valid, too."""
    wrong = []
    for module, tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (
                text := ast.get_docstring(node)
            ):
                own = {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}
                page = Page(PACKAGE / module, text)
                wrong += [
                    f"{module}: {line}" for line in problems(page) if line.split("`")[1] not in own
                ]
    assert not wrong, "\n".join(wrong)


def recipes() -> dict[str, str]:
    """Text of each recipe in CONTRIBUTING."""
    texts: dict[str, str] = {}
    for line in CONTRIBUTING.prose:
        if line.headings[1:2] == ("Recipes",) and len(line.headings) == 3:
            texts[line.headings[2]] = f"{texts.get(line.headings[2], '')}\n{line.text}"
    return texts


def test_tables_named_in_recipes_are_in_the_named_files():
    rows = [
        line.text for line in ARCHITECTURE.prose if line.headings[-1:] == ("Where to add things",)
    ]
    for text in (*recipes().values(), *rows):
        files = [
            file for name in re.findall(r"`([\w/]+\.py)`", text) for file in source_files(name)
        ]
        tables = set(re.findall(r"`(_?[A-Z]{3}[A-Z_]+)`", text))
        assert not files or tables <= {name for file in files for name in top_level(file)}, text


def test_every_recipe_ends_with_its_proof():
    proof = re.compile(r"\*\*Proof\*\*, `tests/\w+/test_\w+\.py`")
    assert len(recipes()) > 5
    assert [name for name, text in recipes().items() if not proof.search(text)] == []


def source_files(name: str) -> list[Path]:
    return [
        path for folder in (ROOT, PACKAGE, *PACKAGE.iterdir()) if (path := folder / name).is_file()
    ]


def top_level(file: Path) -> set[str]:
    return {
        name.id
        for node in parsed(file).body
        for name in ast.walk(node)
        if isinstance(name, ast.Name)
    }


def test_the_page_of_quantities_matches_the_catalogue():
    script = spec_from_file_location("make_quantities", ROOT / "docs" / "make_quantities.py")
    module = module_from_spec(script)
    script.loader.exec_module(module)
    assert module.PAGE.read_text("utf-8") == module.page(), "make docs regenerates it"


MISTAKES = {
    "a path": [
        "src/asperity/gone.py",
        "lubricant/gone.py",
        "tests/unit/test_gone.py",
        "never-was.csv",
        "gone/",
    ],
    "a name": ["solve_contract", "_FIRST_RESORTS", "asp.solve_contract", "test_that_never_was"],
    "an attribute": [
        "LoadSharing.clr_sold",
        "asperity.wear.Stage",
        "convergence.eror",
        "ehl.solve_contract",
        ".gian",
    ],
    "a call": [
        "acceleration(way='exact')",
        'contact_resonance(method="peek")',
        "solve_contract(case)",
    ],
    "elsewhere": [
        "scipy.signal.freqs_of",
        "python -m benchmarks.gone",
        "make tests",
        "pip install 'asperity[gone]'",
    ],
    "a key of a case": [
        "vibration.stiffness_laws",
        "[vibrations]",
        'contact.lod = ["1 N"]',
        "'grid.z[0]=-4..-1'",
    ],
    "a choice": ['method = "peek"', '"hertz-pont"', '{ law = "barrus", eta0 = "1 Pa s" }'],
    "a command": [
        "asperity trace",
        "asperity track FILE... [--speeds 3]",
        "trace --json",
        "asperity solve a b",
    ],
    "an option": [
        "--raet",
        "--set contact.lod=1",
        "asperity solve --out --json",
        "asperity solve x --set a=1",
    ],
    "a list": ["car, carr"],
}


@pytest.mark.parametrize(
    ("kind", "text"), [(kind, text) for kind, texts in MISTAKES.items() for text in texts]
)
def test_a_mistake_of_each_kind_is_detected(kind, text):
    assert span_error(text, ROOT / "docs" / "a.md") is not None, kind


def test_a_mistake_is_reported_with_its_line():
    text = (
        "# T\n\n## track\n\n`--band` or\n`--cells`; [x](gone.md), [y](#gone), [T](#t).\n\n`--json`:"
        " `clr`, `crl`.\n"
    )
    page = Page(ROOT / "docs" / "a.md", text)
    assert [line.split(": ")[0] for line in problems(page)] == ["docs/a.md:6", "docs/a.md:8"]
    assert [target for _, target in page.links() if not link_resolves(page, target)] == [
        "gone.md",
        "#gone",
    ]
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
def test_a_mistake_in_a_block_is_detected(language, text):
    page = Page(ROOT / "docs" / "a.md", f"```{language}\n{text}\n```\n")
    assert len(list(block_problems(page))) == 1


def test_every_exception_is_needed():
    spans = {span.text: (page, span) for page in pages() for span in page.spans()}
    assert sorted(EXCEPTIONS.keys() - spans.keys()) == []
    located = ((text, *spans[text]) for text in EXCEPTIONS)
    assert [
        text
        for text, page, span in located
        if span_error(text, page.path, span.line.headings) is None
    ] == []
    texts = {
        word: [name for name in sections() if word in names_in(json_lines(sections()[name]))]
        for word in JSON_EXCEPTIONS
    }
    assert [
        w
        for w, names in texts.items()
        if all(w in json_keys(n) | json_texts(n) for n in names if golden(n))
    ] == []
