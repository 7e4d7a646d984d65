"""Examples in the docstrings of public names run and print what they show."""

import ast
import doctest

import pytest

from support.source import exported, faces, modules

FEWEST = 80  # public names with an example


def with_example() -> dict[str, object]:
    """Return the public names whose docstring holds an example, each object once."""
    objects = {
        id(value): (f"{face}.{name}", value)
        for face, module in faces().items()
        for name, value in exported(module).items()
        if callable(value) and ">>>" in (value.__doc__ or "")
    }
    return dict(objects.values())


@pytest.mark.parametrize("name", with_example())
def test_the_example_of_a_public_name_runs(name):
    value = with_example()[name]
    finder = doctest.DocTestFinder(recurse=False)
    (example,) = finder.find(value, name=name, globs={})
    printed: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example, out=printed.append)
    assert result.attempted > 0
    assert result.failed == 0, "".join(printed)


def test_many_public_names_have_an_example():
    assert len(with_example()) >= FEWEST


def test_no_example_stands_where_it_is_not_run():
    run = {value.__doc__ for value in with_example().values()}
    hidden = [
        f"{name} {node.name}"
        for name, tree in modules()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        and ">>>" in (text := ast.get_docstring(node, clean=False) or "")
        and text not in run
    ]
    assert hidden == []
