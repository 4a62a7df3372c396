"""How the documentation site is built: `make docs`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import generate

project = "daq-app"
author = "The daq-app authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode", "sphinx-mathjax-offline"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 4
html_theme = "furo"
html_static_path, html_css_files = ["_static"], ["tables.css"]
html_title = "daq-app"
html_show_copyright = False  # the licence is in LICENSE
exclude_patterns = ["_build"]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
# A page that a reader opens on GitHub links to files of the code, which are no pages of this site.
suppress_warnings = ["myst.xref_missing"]


def setup(app):
    """Write the reference pages that come from the program itself before Sphinx reads them."""
    app.connect("builder-inited", lambda _app: generate.write(Path(__file__).parent / "reference" / "generated"))
