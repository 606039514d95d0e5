"""The site of the documents: `make docs`."""

import re
from os.path import relpath
from pathlib import Path

from sphinx.application import Sphinx

project = "multiradar"
author = "the multiradar developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["deflist"]
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
    application.connect("source-read", lambda _, page, text: _relink(text, f"docs/{page}", page))
    application.connect("include-read", lambda _, file, page, text: _relink(text, file.name, page))


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
