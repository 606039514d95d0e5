"""Parts of a page that a script makes, between a comment that names both and one that ends it."""

import re
from pathlib import Path


def put(page: Path, name: str, text: str) -> None:
    """Replace what stands between the marks of a part.

    Parameters
    ----------
    page : Path
        The page.
    name : str
        Of the part: it begins with ``<!-- NAME: made by …  -->`` and ends with
        ``<!-- end of NAME -->``.
    text : str
        What is to stand there.
    """
    begin, end = rf"<!-- {re.escape(name)}: made by [^>]*-->", f"<!-- end of {name} -->"
    marked = re.compile(f"({begin}).*?{re.escape(end)}", re.DOTALL)
    before = page.read_text(encoding="utf-8")
    if not marked.search(before):
        raise SystemExit(f"{page}: expected the marks of {name}, found none")
    after = marked.sub(lambda found: f"{found[1]}\n\n{text.strip()}\n\n{end}", before)
    page.write_text(after, encoding="utf-8")
