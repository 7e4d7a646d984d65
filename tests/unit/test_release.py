"""Consistency of a release: one version, valid metadata, dependencies as in pyproject."""

import copy
import json
import os
import re
import subprocess
import sys
import tomllib

import jsonschema
import pytest
import yaml

from support.source import PACKAGE, ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
CONDA = {"matplotlib": "matplotlib-base", "soundfile": "pysoundfile"}  # names on conda-forge
LARGEST = 4_450_000  # bytes of the installed package without dependencies


def load_metadata(name: str) -> dict:
    text = (ROOT / name).read_text("utf-8")
    return json.loads(text) if name.endswith(".json") else yaml.safe_load(text)


def schema(name: str) -> dict:
    return json.loads((ROOT / "tests" / "reference" / "schemas" / name).read_text("utf-8"))


FILES = {
    "CITATION.cff": "citation-file-format-1.2.0.json",
    "codemeta.json": "codemeta.json",
    ".zenodo.json": "zenodo.json",
}


@pytest.mark.parametrize(("file", "by"), FILES.items())
def test_metadata_match_their_schema(file, by):
    jsonschema.validate(load_metadata(file), schema(by))


@pytest.mark.parametrize(("file", "by"), FILES.items())
def test_metadata_without_a_name_or_with_an_unknown_key_are_refused(file, by):
    content = load_metadata(file)
    unnamed = {key: value for key, value in content.items() if key not in ("title", "name")}
    for wrong in (unnamed, {**content, "strange": 1}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema(by))


def test_all_files_state_one_version():
    versions = {name: load_metadata(name)["version"] for name in FILES}
    versions["recipe"] = load_metadata("recipe/recipe.yaml")["context"]["version"]
    assert versions == dict.fromkeys(versions, PROJECT["version"])


def test_all_files_state_the_changelogs_release_date():
    versions = re.findall(
        r"^## \[([\d.]+)\] - (\d{4}-\d{2}-\d{2})$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M
    )
    assert versions[0][0] == PROJECT["version"]
    assert (
        str(load_metadata("CITATION.cff")["date-released"])
        == load_metadata("codemeta.json")["datePublished"]
        == versions[0][1]
    )
    assert [version for version, _ in versions] == sorted(
        (version for version, _ in versions), reverse=True
    )


def test_all_files_state_one_paper_and_licence():
    doi = load_metadata("CITATION.cff")["preferred-citation"]["doi"]
    assert load_metadata("codemeta.json")["referencePublication"]["@id"] == f"https://doi.org/{doi}"
    assert load_metadata(".zenodo.json")["related_identifiers"][0]["identifier"] == doi
    assert (
        load_metadata("CITATION.cff")["license"]
        == load_metadata(".zenodo.json")["license"]
        == PROJECT["license"]
    )
    assert load_metadata("codemeta.json")["license"].endswith(f"/{PROJECT['license']}")


def test_recipe_and_metadata_have_the_projects_dependencies():
    assert load_metadata("codemeta.json")["softwareRequirements"] == PROJECT["dependencies"]
    expected = {
        CONDA.get(name, name).lower(): bound
        for name, bound in map(name_and_bound, PROJECT["dependencies"])
    }
    expected["python"] = PROJECT["requires-python"]
    requirements = load_metadata("recipe/recipe.yaml")["requirements"]
    assert dict(map(name_and_bound, requirements["run"])) == expected
    extras = [need for needs in PROJECT["optional-dependencies"].values() for need in needs]
    optional = {CONDA.get(name, name).lower(): bound for name, bound in map(name_and_bound, extras)}
    assert dict(map(name_and_bound, requirements["run_constraints"])) == optional


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("", ""),
        ("requirements:", "requirments:"),
        ("noarch: python", "noarch: snake"),
        ("- numpy >=2.1", "- numpy >=>2"),
    ],
)
def test_conda_forges_builder_accepts_the_recipe(right, wrong):
    """Rendered by rattler-build; refusal of a wrong recipe shows that it is read."""
    builder = pytest.importorskip("rattler_build", reason="a package of the development group")
    text = (ROOT / "recipe" / "recipe.yaml").read_text("utf-8")
    assert right in text

    def rendered() -> tuple[str, str]:
        (variant,) = builder.Stage0Recipe.from_yaml(text.replace(right, wrong)).render(
            builder.VariantConfig()
        )
        return str(variant.recipe.package.name), str(variant.recipe.package.version)

    if not right:
        assert rendered() == ("asperity", PROJECT["version"])
        return
    with pytest.raises(builder.RecipeParseError):
        rendered()


PLACEHOLDER_AUTHOR = "The asperity developers"  # placeholder for the authors until a release
FILLED = ("pyproject.toml", "CITATION.cff", "codemeta.json", ".zenodo.json", "recipe/recipe.yaml")


def metadata() -> dict[str, dict]:
    return {
        "pyproject.toml": {"project": PROJECT},
        **{name: load_metadata(name) for name in FILLED[1:]},
    }


def open_metadata(given: dict[str, dict]) -> list[str]:
    """Missing release metadata of these files, as file and key."""
    project, citation, codemeta, zenodo, recipe = (given[name] for name in FILLED)
    named = {
        "pyproject.toml authors": [author["name"] for author in project["project"]["authors"]],
        "CITATION.cff authors": [author.get("name") for author in citation["authors"]],
        "codemeta.json author": [author["name"] for author in codemeta["author"]],
        ".zenodo.json creators": [author["name"] for author in zenodo["creators"]],
    }
    addresses = {
        "pyproject.toml urls": project["project"].get("urls", {}).get("Repository"),
        "CITATION.cff repository-code": citation.get("repository-code"),
        "codemeta.json codeRepository": codemeta.get("codeRepository"),
        "recipe/recipe.yaml source.url": recipe["source"].get("url"),
        "recipe/recipe.yaml source.sha256": recipe["source"].get("sha256"),
        "recipe/recipe.yaml about.repository": recipe["about"].get("repository"),
    }
    return [key for key, names in named.items() if PLACEHOLDER_AUTHOR in names] + [
        key for key, value in addresses.items() if not value
    ]


def test_a_release_states_authors_and_addresses():
    """Run by `make release` only: before publication there is no address."""
    if not os.environ.get("ASPERITY_RELEASE"):
        pytest.skip("run by make release only")
    assert open_metadata(metadata()) == []


def test_open_release_metadata_are_detected_and_listed():
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    rows = dict(
        re.findall(r"^\| ([\w./-]+\.\w+) \| (.+) \|$", text.partition("## A release")[2], re.M)
    )
    assert set(rows) == set(FILLED)
    complete = copy.deepcopy(metadata())
    author, address = {"name": "A. Author"}, "https://example.org/asperity"
    complete["pyproject.toml"]["project"] |= {"authors": [author], "urls": {"Repository": address}}
    complete["CITATION.cff"] |= {
        "authors": [{"family-names": "A. Author"}],
        "repository-code": address,
    }
    complete["codemeta.json"] |= {"author": [author], "codeRepository": address}
    complete[".zenodo.json"]["creators"] = [author]
    complete["recipe/recipe.yaml"]["source"] = {"url": address, "sha256": "0" * 64}
    complete["recipe/recipe.yaml"]["about"]["repository"] = address
    assert open_metadata(complete) == []
    for file in FILLED:
        missing = open_metadata(complete | {file: metadata()[file]})
        assert all(entry.startswith(f"{file} ") for entry in missing)
        assert all(entry.rpartition(" ")[2].rpartition(".")[2] in rows[file] for entry in missing)
    assert (
        "ASPERITY_RELEASE=1"
        in (ROOT / "Makefile").read_text("utf-8").partition("\nrelease:")[2].partition("\n\n")[0]
    )


def name_and_bound(requirement: str) -> tuple[str, str]:
    name, bound = re.fullmatch(r"([\w-]+) ?(>=[\d.]+(?:,<[\d.]+)?)", requirement).groups()
    return name, bound


def test_the_package_stays_small():
    """Installed files only: folder sizes depend on the file system, and caches do not count."""
    files = (
        path
        for path in PACKAGE.rglob("*")
        if path.is_file() and path.suffix not in (".pyc", ".nbi", ".nbc")
    )
    assert sum(path.stat().st_size for path in files) < LARGEST


def test_the_claimed_python_versions_were_tested():
    """Python 3.14 appears only where the docs state that it was not tested."""
    claimed = {
        classifier.rpartition(" ")[2]
        for classifier in PROJECT["classifiers"]
        if re.search(r"Python :: 3\.\d", classifier)
    }
    page = (ROOT / "docs" / "project" / "how-it-was-made.md").read_text("utf-8")
    assert claimed == {"3.11", "3.12", "3.13"}
    assert "tested on 3.11 to 3.13; 3.14 was not" in page


def test_a_bug_report_has_versions_and_no_paths():
    command = [sys.executable, "-m", "asperity", "--version", "--verbose"]
    report = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    lines = report.splitlines()
    assert re.fullmatch(r"asperity \d+\.\d+\.\d+", lines[0])
    assert lines[1].startswith(f"Python {sys.version_info.major}.{sys.version_info.minor}")
    assert sum(line.startswith("numpy ") for line in lines) == 1
    assert all(
        any(line.lower().startswith(name_and_bound(need)[0].lower()) for line in lines)
        for need in PROJECT["dependencies"]
    )
    assert re.search(r"[/\\~]\w", report) is None
    output = subprocess.run(command[:-1], capture_output=True, text=True, check=True).stdout
    assert output == f"{lines[0]}\n"
