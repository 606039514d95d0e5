"""The site of the documents: `make docs`."""

import re
from os.path import relpath
from pathlib import Path

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

project = "multiradar"
author = "the multiradar developers"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["deflist"]
# Equations, of pages that enable them, are MathML, which browsers draw without a script.
html_math_renderer = "mathml"
# Notebooks run when the site is built; an unchanged one is not run again.
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 600
# Headings can be linked as on GitHub.
myst_heading_anchors = 4
html_theme = "furo"
html_title = project
html_copy_source = False
html_show_copyright = False
napoleon_google_docstring = False
autodoc_typehints = "description"
# Answers are shown shortened, with an ellipsis, which no lexer knows.
highlight_language = "none"
suppress_warnings = ["misc.highlighting_failure"]

ROOT = Path(__file__).parents[1]
_LINK = re.compile(r"\]\((?![a-z]+:|#)([^)#\s]+)(#[^)]*)?\)")
_NAMED = re.compile(r"\[([^\]]+)\]\(outside\)")
# Pages of the repository that the site contains elsewhere.
_PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "DECISIONS.md": "decisions.md",
}


def setup(application: Sphinx) -> None:
    """Let the links of the documents hold in the repository and on the site."""
    application.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    application.connect("source-read", lambda _, page, text: _relink(text, f"docs/{page}", page))
    application.connect("include-read", lambda _, file, page, text: _relink(text, file.name, page))


def _inline(page: HTML5Translator, node: nodes.math) -> None:
    page.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def _display(page: HTML5Translator, node: nodes.math_block) -> None:
    page.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


def _relink(text: list[str], file: str, page: str) -> None:
    folder = (ROOT / file).parent

    def relinked(link: re.Match[str]) -> str:
        target = (folder / link[1]).resolve()
        if not target.exists():
            raise ValueError(f"{file}: expected {link[1]} to exist")
        if (name := target.relative_to(ROOT).as_posix()) in _PAGES:
            target = ROOT / "docs" / _PAGES[name]
        if not target.is_relative_to(ROOT / "docs"):
            return "](outside)"
        return f"]({relpath(target, (ROOT / 'docs' / page).parent)}{link[2] or ''})"

    # A file of the repository that is not a document is named, not linked.
    text[0] = _NAMED.sub(r"\1", _LINK.sub(relinked, text[0]))
