"""Sphinx builds the pages with this; `make docs` does it."""

import sys
from pathlib import Path

import debulk

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "debulk"
version = release = debulk.__version__
author = "the authors of debulk"
copyright = "the authors of debulk, Apache-2.0"

# MathJax comes from its package: pages are read on machines without the net.
extensions = ["myst_parser", "sphinx-mathjax-offline", "sphinx.ext.mathjax", "recipe_reference", "checks_reference"]
extensions += ["sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["extensions", "examples"]
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]  # types of other packages, whose pages are not at hand
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say shapes and units
napoleon_google_docstring = False

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 4

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_title = f"debulk {version}"
html_copy_source = False
html_show_sphinx = False
html_show_search_summary = False  # it would be fetched, which a page from a file may not do
