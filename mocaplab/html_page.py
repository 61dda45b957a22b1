"""Pages of HTML that need no network: text, tables, and pictures inside the page."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; padding: 1rem; max-width: 60rem;
  color: #1a1a1a; background: #ffffff; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; margin-top: 2rem; }
img { width: 100%; height: auto; }
table { border-collapse: collapse; width: 100%; }
th, td { border-bottom: 1px solid #cccccc; padding: 0.3rem 0.4rem; text-align: right; }
th:first-child, td:first-child { text-align: left; overflow-wrap: anywhere; }
table.words th, table.words td { text-align: left; vertical-align: top; overflow-wrap: normal; }
p.note { color: #555555; font-size: 0.9rem; }
"""


def page(title: str, sections: Sequence[str]) -> str:
    """Return a whole page; the sections are HTML already."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head>\n<body>\n"
        + "\n".join(sections)
        + "\n</body></html>\n"
    )


def heading(text: str, level: int = 2) -> str:
    """Return a heading."""
    return f"<h{level}>{html.escape(text)}</h{level}>"


def paragraph(text: str) -> str:
    """Return a paragraph."""
    return f"<p>{html.escape(text)}</p>"


def note(text: str) -> str:
    """Return a paragraph in small grey letters."""
    return f'<p class="note">{html.escape(text)}</p>'


def bullets(lines: Sequence[str]) -> str:
    """Return a list of lines."""
    return "<ul>" + "".join(f"<li>{html.escape(line)}</li>" for line in lines) + "</ul>"


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, words: bool = False) -> str:
    """Return a table: of numbers, or with ``words``, of sentences, which begin at the left."""

    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(c)}</{tag}>" for c in cells) + "</tr>"

    body = row(head, "th") + "".join(row(cells, "td") for cells in rows)
    kind = ' class="words"' if words else ""
    return f"<table{kind}>{body}</table>"


def picture(png: bytes, alt: str) -> str:
    """Return a picture that is kept in the page itself; alt says what it shows."""
    text = base64.b64encode(png).decode()
    return f'<img alt="{html.escape(alt)}" src="data:image/png;base64,{text}">'
