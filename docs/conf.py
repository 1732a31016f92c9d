"""The site of the documentation: `make docs` writes it to out/site, readable without a network."""

from gelslim_core import __version__

project = "gelslim-cad"
author = "The gelslim-cad developers"
copyright = author
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
myst_heading_anchors = 4
root_doc = "index"
default_role = "code"
exclude_patterns = ["README.md", "data", "conf.py"]
suppress_warnings = ["myst.xref_missing", "misc.highlighting_failure"]

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_mock_imports: list[str] = []
napoleon_google_docstring = True
napoleon_numpy_docstring = False

html_theme = "furo"
html_title = f"gelslim-cad {release}"
html_static_path: list[str] = []
html_copy_source = False
