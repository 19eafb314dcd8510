"""The documentation site: python -m sphinx -W -b html docs site

Pages are Markdown, and read as they are on the web; what the code knows (commands, names) is generated from it.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(Path(__file__).parent))

project, author = "flatpush", "the flatpush authors"
release = re.search(r'^version = "(.*?)"', (ROOT / "pyproject.toml").read_text("utf-8"), re.M)[1]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "from_code"]
exclude_patterns = ["site", "_build"]
html_theme = "pydata_sphinx_theme"
html_title = f"flatpush {release}"
html_theme_options = {
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "navbar_center": [],
}
html_sidebars = {"**": ["globaltoc.html"]}
myst_heading_anchors = 3
myst_enable_extensions = ["deflist"]
# A YAML fence that shows a scene, or a sequence of them, need not be highlighted to the last letter.
suppress_warnings = ["misc.highlighting_failure"]
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = True
napoleon_use_ivar = True
