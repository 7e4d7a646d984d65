"""What a release states of itself: one version everywhere, metadata by their schemas, needs as
pyproject has them.
"""

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
CONDA = {"matplotlib": "matplotlib-base", "soundfile": "pysoundfile"}  # what conda-forge calls them
LARGEST = 3_100_000  # bytes of the package as it is installed, without its needs


def stated(name: str) -> dict:
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
def test_metadata_meet_their_schema(file, by):
    jsonschema.validate(stated(file), schema(by))


@pytest.mark.parametrize(("file", "by"), FILES.items())
def test_metadata_without_a_name_or_with_a_strange_key_are_refused(file, by):
    whole = stated(file)
    without = {key: value for key, value in whole.items() if key not in ("title", "name")}
    for wrong in (without, {**whole, "strange": 1}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema(by))


def test_one_version_stands_everywhere():
    versions = {name: stated(name)["version"] for name in FILES}
    versions["recipe"] = stated("recipe/recipe.yaml")["context"]["version"]
    assert versions == dict.fromkeys(versions, PROJECT["version"])


def test_one_date_stands_everywhere_that_of_the_changelogs_heading():
    versions = re.findall(
        r"^## \[([\d.]+)\] - (\d{4}-\d{2}-\d{2})$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M
    )
    assert versions[0][0] == PROJECT["version"]
    assert (
        str(stated("CITATION.cff")["date-released"])
        == stated("codemeta.json")["datePublished"]
        == versions[0][1]
    )
    assert [version for version, _ in versions] == sorted(
        (version for version, _ in versions), reverse=True
    )


def test_one_paper_and_one_licence():
    doi = stated("CITATION.cff")["preferred-citation"]["doi"]
    assert stated("codemeta.json")["referencePublication"]["@id"] == f"https://doi.org/{doi}"
    assert stated(".zenodo.json")["related_identifiers"][0]["identifier"] == doi
    assert (
        stated("CITATION.cff")["license"] == stated(".zenodo.json")["license"] == PROJECT["license"]
    )
    assert stated("codemeta.json")["license"].endswith(f"/{PROJECT['license']}")


def test_recipe_and_metadata_need_what_the_project_needs():
    assert stated("codemeta.json")["softwareRequirements"] == PROJECT["dependencies"]
    wanted = {
        CONDA.get(name, name).lower(): bound for name, bound in map(split, PROJECT["dependencies"])
    }
    wanted["python"] = PROJECT["requires-python"]
    requirements = stated("recipe/recipe.yaml")["requirements"]
    assert dict(map(split, requirements["run"])) == wanted
    extras = [need for needs in PROJECT["optional-dependencies"].values() for need in needs]
    optional = {CONDA.get(name, name).lower(): bound for name, bound in map(split, extras)}
    assert dict(map(split, requirements["run_constraints"])) == optional


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("", ""),
        ("requirements:", "requirments:"),
        ("noarch: python", "noarch: snake"),
        ("- numpy >=2.1", "- numpy >=>2"),
    ],
)
def test_the_recipe_is_one_to_conda_forges_builder(right, wrong):
    """Read and rendered by rattler-build; that a wrong one is refused shows that it is read."""
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


NOBODY = "The asperity developers"  # whose names a release states
FILLED = ("pyproject.toml", "CITATION.cff", "codemeta.json", ".zenodo.json", "recipe/recipe.yaml")


def metadata() -> dict[str, dict]:
    return {"pyproject.toml": {"project": PROJECT}, **{name: stated(name) for name in FILLED[1:]}}


def unfilled(given: dict[str, dict]) -> list[str]:
    """What a release has to state and these files leave open, as file and key."""
    project, citation, codemeta, zenodo, recipe = (given[name] for name in FILLED)
    named = {
        "pyproject.toml authors": [one["name"] for one in project["project"]["authors"]],
        "CITATION.cff authors": [one.get("name") for one in citation["authors"]],
        "codemeta.json author": [one["name"] for one in codemeta["author"]],
        ".zenodo.json creators": [one["name"] for one in zenodo["creators"]],
    }
    addresses = {
        "pyproject.toml urls": project["project"].get("urls", {}).get("Repository"),
        "CITATION.cff repository-code": citation.get("repository-code"),
        "codemeta.json codeRepository": codemeta.get("codeRepository"),
        "recipe/recipe.yaml source.url": recipe["source"].get("url"),
        "recipe/recipe.yaml source.sha256": recipe["source"].get("sha256"),
        "recipe/recipe.yaml about.repository": recipe["about"].get("repository"),
    }
    return [key for key, names in named.items() if NOBODY in names] + [
        key for key, said in addresses.items() if not said
    ]


def test_a_release_states_who_and_where():
    """Asked by `make release` alone: nothing is published yet, so there is no address to state."""
    if not os.environ.get("ASPERITY_RELEASE"):
        pytest.skip("no release is built: make release asks")
    assert unfilled(metadata()) == []


def test_what_a_release_leaves_open_is_seen_and_listed():
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    rows = dict(
        re.findall(r"^\| ([\w./-]+\.\w+) \| (.+) \|$", text.partition("## A release")[2], re.M)
    )
    assert set(rows) == set(FILLED)
    whole = copy.deepcopy(metadata())
    person, place = {"name": "Somebody"}, "https://example.org/asperity"
    whole["pyproject.toml"]["project"] |= {"authors": [person], "urls": {"Repository": place}}
    whole["CITATION.cff"] |= {"authors": [{"family-names": "Somebody"}], "repository-code": place}
    whole["codemeta.json"] |= {"author": [person], "codeRepository": place}
    whole[".zenodo.json"]["creators"] = [person]
    whole["recipe/recipe.yaml"]["source"] = {"url": place, "sha256": "0" * 64}
    whole["recipe/recipe.yaml"]["about"]["repository"] = place
    assert unfilled(whole) == []
    for file in FILLED:
        open_ones = unfilled(whole | {file: metadata()[file]})
        assert all(one.startswith(f"{file} ") for one in open_ones)
        assert all(one.rpartition(" ")[2].rpartition(".")[2] in rows[file] for one in open_ones)
    assert (
        "ASPERITY_RELEASE=1"
        in (ROOT / "Makefile").read_text("utf-8").partition("\nrelease:")[2].partition("\n\n")[0]
    )


def split(requirement: str) -> tuple[str, str]:
    name, bound = re.fullmatch(r"([\w-]+) ?(>=[\d.]+)", requirement).groups()
    return name, bound


def test_the_package_stays_small():
    """Its files: a folder's own size is the file system's, and one of caches is none of the
    package.
    """
    files = (
        path
        for path in PACKAGE.rglob("*")
        if path.is_file() and path.suffix not in (".pyc", ".nbi", ".nbc")
    )
    assert sum(path.stat().st_size for path in files) < LARGEST


def test_the_pythons_that_are_claimed_are_those_that_were_tested():
    """3.14 is named where it is said that it was not."""
    claimed = {
        one.rpartition(" ")[2]
        for one in PROJECT["classifiers"]
        if re.search(r"Python :: 3\.\d", one)
    }
    said = (ROOT / "docs" / "project" / "how-it-was-made.md").read_text("utf-8")
    assert claimed == {"3.11", "3.12", "3.13"}
    assert "tested on 3.11 to 3.13; 3.14 was not" in said


def test_what_a_bug_report_says_has_versions_and_no_paths():
    command = [sys.executable, "-m", "asperity", "--version", "--verbose"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    lines = said.splitlines()
    assert re.fullmatch(r"asperity \d+\.\d+\.\d+", lines[0])
    assert lines[1].startswith(f"Python {sys.version_info.major}.{sys.version_info.minor}")
    assert sum(line.startswith("numpy ") for line in lines) == 1
    assert all(
        any(line.lower().startswith(split(need)[0].lower()) for line in lines)
        for need in PROJECT["dependencies"]
    )
    assert re.search(r"[/\\~]\w", said) is None
    plain = subprocess.run(command[:-1], capture_output=True, text=True, check=True).stdout
    assert plain == f"{lines[0]}\n"
