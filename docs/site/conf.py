# Configuration of the site (scripts/docs.sh): Sphinx reads it from build/site/source.
import os

project = "tpmkit"
author = "The tpmkit authors"
copyright = "The tpmkit authors, MIT licence"
version = release = os.environ.get("TPMKIT_VERSION", "")
root_doc = "docs/site/index"
extensions = ["myst_parser", "breathe"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 5
myst_enable_extensions = ["deflist", "dollarmath", "html_image"]
# Formulas are set by the MathJax 2 that scripts/docs.sh puts beside the pages: no network is needed to read them.
myst_update_mathjax = False
mathjax_path = "mathjax/MathJax.js?config=TeX-AMS_SVG-full"
mathjax2_config = {
    "messageStyle": "none",
    "TeX": {"noUndefined": {"disabled": True}},  # a misspelt command is an error, which site_pages.py counts
    "tex2jax": {"inlineMath": [["\\(", "\\)"]], "displayMath": [["\\[", "\\]"]]},
}
# Pages are read on GitHub as well: their first heading may follow a note, and levels may be left out.
suppress_warnings = ["myst.header", "misc.highlighting_failure"]
highlight_language = "none"
exclude_patterns = ["docs/site/source"]
breathe_projects = {"tpmkit": os.environ.get("TPMKIT_DOXYGEN", "")}
breathe_default_project = "tpmkit"
breathe_domain_by_extension = {"h": "c", "hpp": "cpp"}
breathe_show_include = False
nitpicky = False
html_theme = "furo"
html_title = f"tpmkit {version}"
html_static_path = ["docs/site/static"]
html_css_files = ["site.css"]
html_search_scorer = "docs/site/static/scorer.js"
html_copy_source = False
html_show_sphinx = False
html_last_updated_fmt = None
html_theme_options = {"navigation_with_keys": True}
