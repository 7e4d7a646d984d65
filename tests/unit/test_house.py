"""The measures of the house: how long files and functions may be, how deep folders, and what a face must hand out."""

import ast

from support.source import (
    PACKAGE,
    exported,
    faces,
    files,
    functions,
    imports_inside_functions,
    modules,
    own_types,
)

LONGEST_FILE = 450  # lines
LONGEST_FUNCTION = 70  # lines, docstring and all
DEEPEST = 3  # folders below src
IMPORTS_INSIDE_FUNCTIONS = 80  # fewer than that, and only where they save start-up time


def test_no_file_is_too_long():
    lines = {
        path.relative_to(PACKAGE).as_posix(): path.read_text("utf-8").count("\n")
        for path in files()
    }
    long = [f"{name}: {count} lines" for name, count in lines.items() if count > LONGEST_FILE]
    assert not long, "\n".join(long)


def test_no_folder_is_too_deep():
    folders = {path.relative_to(PACKAGE.parent).parent for path in files()}
    assert [folder for folder in folders if len(folder.parts) > DEEPEST] == []


def test_no_function_is_too_long():
    lengths = [
        (function.end_lineno - function.lineno + 1, f"{name} {function.name}")
        for name, tree in modules()
        for function in functions(tree)
    ]
    long = [f"{name}: {length} lines" for length, name in lengths if length > LONGEST_FUNCTION]
    assert not long, "\n".join(long)


def test_imports_stand_at_the_top():
    inside = [(len(imports_inside_functions(tree)), name) for name, tree in modules()]
    listed = "\n".join(f"{name}: {count}" for count, name in sorted(inside, reverse=True) if count)
    assert sum(count for count, _ in inside) < IMPORTS_INSIDE_FUNCTIONS, listed


def test_an_import_inside_a_nested_function_is_counted_once():
    tree = ast.parse("import os\ndef f():\n    import a\n    def g():\n        from b import c\n")
    assert len(imports_inside_functions(tree)) == 2


def test_types_that_public_functions_use_are_public():
    handed_out = {name: exported(face) for name, face in faces().items()}
    public = {id(thing) for names in handed_out.values() for thing in names.values()}
    hidden = {
        f"{used.__module__}.{used.__qualname__}, of {face}.{name}"
        for face, names in handed_out.items()
        for name, thing in names.items()
        for used in own_types(thing)
        if id(used) not in public
    }
    assert not hidden, "\n".join(sorted(hidden))
