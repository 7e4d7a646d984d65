"""Size limits of files, functions, argument lists and folders, and the exports of each package.

A limit that is not yet met has a ratchet: the current value, which may only decrease.
"""

import ast
import re

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
LONGEST_FUNCTION = 70  # lines, including the docstring
MOST_NODES = 350  # syntax nodes of a function
MOST_PARAMETERS = 8  # library only; a command has one parameter per option
DEEPEST = 3  # folders below src
IMPORTS_INSIDE_FUNCTIONS = 83  # upper limit; allowed only where they save start-up time
LARGE_KERNELS = 18  # ratchet: compiled kernels above MOST_NODES; their split costs time
MOST_ANY = 230  # ratchet
MOST_LINES = 102_010  # ratchet; aim 57 000
NODES_PER_LINE = 9.5


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


def test_only_compiled_kernels_have_many_nodes():
    sizes = {
        f"{name} {function.name}": sum(1 for _ in ast.walk(function))
        for name, tree in modules()
        for function in functions(tree)
    }
    large = {name for name, size in sizes.items() if size > MOST_NODES}
    kernels = {name for name in large if name.startswith("kernels/")}
    assert large == kernels, "\n".join(sorted(large - kernels))
    assert len(kernels) <= LARGE_KERNELS, "\n".join(sorted(kernels))


def test_argument_lists_are_short():
    counts = {
        f"{name} {function.name}": len(
            function.args.posonlyargs + function.args.args + function.args.kwonlyargs
        )
        for name, tree in modules()
        for function in functions(tree)
        if not name.startswith("cli/")
    }
    assert {name: count for name, count in counts.items() if count > MOST_PARAMETERS} == {}


def test_the_use_of_any_decreases():
    count = sum(
        len(re.findall(r"\bAny\b", path.read_text("utf-8"))) for path in PACKAGE.rglob("*.py")
    )
    assert count <= MOST_ANY


def test_the_source_does_not_grow_and_is_not_dense():
    texts = {path: path.read_text("utf-8") for path in PACKAGE.rglob("*.py")}
    assert sum(text.count("\n") for text in texts.values()) <= MOST_LINES
    nodes = sum(sum(1 for _ in ast.walk(tree)) for _, tree in modules())
    code = sum(
        1
        for text in texts.values()
        for line in re.sub(r'""".*?"""', "", text, flags=re.DOTALL).splitlines()
        if line.strip() and not line.strip().startswith("#")
    )
    assert nodes / code <= NODES_PER_LINE


def test_imports_are_at_module_level():
    inside = [(len(imports_inside_functions(tree)), name) for name, tree in modules()]
    listed = "\n".join(f"{name}: {count}" for count, name in sorted(inside, reverse=True) if count)
    assert sum(count for count, _ in inside) < IMPORTS_INSIDE_FUNCTIONS, listed


def test_an_import_inside_a_nested_function_is_counted_once():
    tree = ast.parse("import os\ndef f():\n    import a\n    def g():\n        from b import c\n")
    assert len(imports_inside_functions(tree)) == 2


def test_types_that_public_functions_use_are_public():
    exports = {name: exported(face) for name, face in faces().items()}
    public = {id(value) for names in exports.values() for value in names.values()}
    hidden = {
        f"{used.__module__}.{used.__qualname__}, used by {face}.{name}"
        for face, names in exports.items()
        for name, value in names.items()
        for used in own_types(value)
        if id(used) not in public
    }
    assert not hidden, "\n".join(sorted(hidden))
