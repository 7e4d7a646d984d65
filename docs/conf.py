"""Sphinx settings for the stage of `docs/build.py`."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from docstrings import described, plain, signed

project = "asperity"
author = "The asperity developers"
copyright = author
release = version = version_of("asperity")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
templates_path = ["_templates"]
exclude_patterns = ["scripts"]  # sources of the gallery
default_role = "literal"
smartquotes_action = "q"  # two hyphens start an option, they are no dash
maximum_signature_line_length = 88

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 6

autosummary_generate = ["reference/api.rst"]
autosummary_ignore_module_all = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "inherited-members": False}
napoleon_google_docstring = False

mathjax_path = "mathjax/tex-svg.js"  # staged: equations need no network
mathjax3_config = {"options": {"enableMenu": False}}  # the menu loads speech rules from the network
copybutton_prompt_text = "$ "

html_search_scorer = str(Path(__file__).parent / "search_scorer.js")
html_theme = "pydata_sphinx_theme"
html_title = "asperity"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_extra_path = ["explorer.html"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "logo": {"text": "asperity"},
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "navbar_align": "left",
    "header_links_before_dropdown": 8,
    "footer_start": ["copyright"],
    "footer_end": [],
    "use_edit_page_button": False,
}
html_context = {"default_mode": "auto"}
html_sidebars = {"index": []}

sphinx_gallery_conf = {
    "examples_dirs": "scripts",
    "gallery_dirs": "gallery",
    "subsection_order": [
        f"scripts/{name}" for name in ("film", "roughness", "friction", "machines", "wear")
    ],
    "thumbnail_size": (480, 336),
    "filename_pattern": r"/\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "show_memory": False,
    "show_signature": False,
    "download_all_examples": False,
    "min_reported_time": 0,
    "capture_repr": (),  # show printed output only, not return values
    "plot_gallery": True,
    "abort_on_example_error": True,
    "remove_config_comments": True,
    "reset_modules": ("docstrings.styled",),
    "image_scrapers": ("matplotlib",),
    "matplotlib_animations": False,
    "nested_sections": False,
    "write_computation_times": False,
    "backreferences_dir": None,
}


def setup(app):
    """Register the conversion of Markdown in docstrings to reStructuredText."""
    app.connect("autodoc-process-docstring", described, priority=100)  # before napoleon
    app.connect("autodoc-process-docstring", plain)
    app.connect("autodoc-process-signature", signed)
