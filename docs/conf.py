"""How Sphinx builds this documentation; `make docs` is the command."""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for the generator of the reference

project = "FRobs"
author = "The FRobs authors"
version = release = installed_version("frobs-core")
copyright = author

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "generate",
]

myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True, "show-inheritance": True}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
add_module_names = False
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"

# Roles that name other packages are not looked up: that would need their inventories from the network. Of the plugins,
# only the classes that their records name have a section.
nitpick_ignore_regex = [
    (
        "py:.*",
        r"(frobs_(?!core|cli|deploy|devkit|train)\w+|abc|collections|enum|gymnasium|mujoco|numpy|pydantic|stable_baselines3|torch|typer|xml|yaml)\..*",
    )
]

html_theme = "furo"
html_title = "FRobs"
html_static_path = ["_static"]
html_css_files = ["frobs.css"]
html_js_files = ["frobs.js"]
html_search_scorer = str(Path(__file__).with_name("scorer.js"))
html_favicon = "_static/mark.svg"
html_logo = "_static/mark.svg"
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": {
        "color-brand-primary": "#b3450b",
        "color-brand-content": "#a53f09",
        "font-stack": "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', 'DejaVu Sans', sans-serif",
    },
    "dark_css_variables": {"color-brand-primary": "#ff9a5c", "color-brand-content": "#ffa66e"},
}
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True
