"""How Sphinx builds the guide:  python -m sphinx -W -b html .docs OUT  (the extra [docs])."""

import logging
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import docstrings  # noqa: E402
import making  # noqa: E402
import mathml  # noqa: E402

import ribbonfem  # noqa: E402

# it tells of every mesh that it makes
logging.getLogger("skfem").setLevel(logging.WARNING)

project = "ribbonfem"
author = "the founders of ribbonfem"
release = version = ribbonfem.__version__
project_copyright = author

extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
# README and CONTRIBUTING are read on code hosts too, where headings may begin anywhere
suppress_warnings = ["myst.header"]
exclude_patterns = ["made/tutorial-*"]
# words between single backticks in docstrings are code
default_role = "code"
add_module_names = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
nitpicky = False

html_theme = "furo"
html_title = f"ribbonfem {release}"
html_math_renderer = "mathml"
html_copy_source = html_show_sourcelink = False
html_static_path = ["static"]
html_css_files = ["guide.css"]
# code is copied from these pages
smartquotes = False
highlight_language = "python"


def setup(app):
    """Formulas as MathML, docstrings as they are written here, and what pages show drawn and listed."""
    mathml.setup(app)
    app.connect("autodoc-process-docstring", docstrings.process)
    app.connect("builder-inited", lambda app: making.everything(HERE / "made"))
