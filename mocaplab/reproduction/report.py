"""The files that a reproduction leaves: data, pictures, paragraphs, and the claim table."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure as Picture

from mocaplab import html_page
from mocaplab.comparison.bootstrap import Interval
from mocaplab.files import write_atomically
from mocaplab.reproduction.claims import Claim, paragraph
from mocaplab.reproduction.figure import Figure
from mocaplab.reproduction.plan import Plan
from mocaplab.reproduction.plots import plot_claims
from mocaplab.reproduction.verdicts import ALIKE, NEARLY, NOT_ASKED

RULES = f"""\
Verdicts come from the numbers by rules (mocaplab/reproduction/verdicts.py). A ratio of two errors \
*holds* if its 95 % interval (bootstrap over clips, the same draws for both) is on the paper's \
side of 1 and reaches the paper's ratio; it *holds weaker* if it does not reach it; it *fails* \
if it is on the other side, or has 1 in it and rules the paper's ratio out. "On every motion" \
holds on all, holds weaker on three of four. "Alike" is within {ALIKE - 1:.0%}, weaker within \
{NEARLY - 1:.0%}. With fewer than 6 clips, or networks trained for fewer than 10 of 200 epochs, \
nothing is tested."""

TITLE = "The papers' figures redone"
HEAD = "figure", "claim", "paper", "ours (95 %)", "verdict", "why"


class Part(NamedTuple):
    """What the report says of one figure."""

    title: str
    asks: str
    picture: str | None  # the file's name
    text: str


def file_name(figure: str) -> str:
    """Name the files of a figure, without an ending."""
    return f"figure_{int(figure):02d}" if figure.isdigit() else f"figure_{figure}"


def rows_to_csv(rows: Sequence[Mapping[str, Any]], label: str) -> str:
    """Write rows as CSV under a comment line that says what they were made with."""
    text = io.StringIO()
    text.write(f"# {label}\n")
    names = list(dict.fromkeys(key for row in rows for key in row))
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
    return text.getvalue()


def claim_rows(claims: Sequence[Claim]) -> list[dict[str, Any]]:
    """Turn claims into the rows of claims.csv."""
    return [
        {
            "figure": claim.figure,
            "claim": claim.text,
            "paper": claim.paper,
            "ours": claim.ours.value,
            "low": claim.ours.low,
            "high": claim.ours.high,
            "unit": claim.unit,
            "clips": claim.clips,
            "verdict": claim.verdict,
            "why": claim.why,
        }
        for claim in claims
    ]


def claim_cells(claims: Sequence[Claim]) -> list[tuple[str, ...]]:
    """Return the cells of the claim table, what the paper claims first."""
    return [
        (c.figure, c.text, c.paper, c.number(), c.verdict, c.why)
        for c in sorted(claims, key=lambda c: c.verdict == NOT_ASKED)
    ]


def claims_to_markdown(claims: Sequence[Claim]) -> str:
    """Write the claim table."""
    lines = [f"| {' | '.join(HEAD)} |", "|" + "---|" * len(HEAD)]
    for *cells, verdict, why in claim_cells(claims):
        lines.append(f"| {' | '.join((*cells, f'**{verdict}**', why))} |")
    return "\n".join(lines)


def save_picture(picture: Picture, title: str, plan: Plan, path: Path) -> None:
    """Write a picture under its title, with what it was made with below it."""
    width = int(16 * picture.get_figwidth())
    picture.suptitle(title)
    picture.supxlabel("\n".join(textwrap.wrap(plan.label(), width)), fontsize=7, color="#555555")
    picture.savefig(path, dpi=110)
    plt.close(picture)


def write_figure(
    figure: Figure,
    rows: Sequence[Mapping[str, Any]],
    picture: Picture,
    claims: Sequence[Claim],
    plan: Plan,
    folder: Path,
) -> Part:
    """Write CSV, picture and paragraph of a figure; return its part of the report."""
    name = file_name(figure.name)
    write_atomically(folder / f"{name}.csv", rows_to_csv(rows, plan.label()))
    save_picture(picture, figure.title, plan, folder / f"{name}.png")
    text = paragraph(claims)
    write_atomically(folder / f"{name}.md", f"{text}\n\nMade with {plan.label()}.\n")
    return Part(figure.title, figure.asks, f"{name}.png", text)


def paper_ratios(rows: Sequence[Mapping[str, Any]]) -> dict[str, tuple[float, Interval]]:
    """Pick the claims about ratios out of the rows of claims.csv: text -> (paper's, ours)."""
    return {
        f"{row['claim']} [{row['figure']}]": (
            float(str(row["paper"]).split()[0]),
            Interval(float(row["ours"]), float(row["low"]), float(row["high"])),
        )
        for row in rows
        if str(row["paper"]).endswith(" times") and np.isfinite(float(row["ours"]))
    }


def write_report(claims: Sequence[Claim], parts: Sequence[Part], plan: Plan, folder: Path) -> None:
    """Write claims.csv, claims.md, report.md, and report.html, which has its pictures inside."""
    write_atomically(folder / "claims.csv", rows_to_csv(claim_rows(claims), plan.label()))
    ratios = paper_ratios(claim_rows(claims))
    if ratios:
        picture, ax = plt.subplots(figsize=(11, 1.6 + 0.35 * len(ratios)), layout="constrained")
        plot_claims(ratios, ax)
        save_picture(picture, "Ratios of errors: the paper's and ours", plan, folder / "claims.png")
    table = Part("Claims", RULES, "claims.png" if ratios else None, claims_to_markdown(claims))
    made = f"Made with {plan.label()}."
    sections = [_to_markdown(part) for part in (table, *parts)]
    write_atomically(folder / "claims.md", f"{sections[0]}\n{made}\n")
    write_atomically(folder / "report.md", "\n".join((f"# {TITLE}\n\n{made}\n", *sections)))
    write_atomically(folder / "report.html", _to_html(claims, (table, *parts), made, folder))


def _to_markdown(part: Part) -> str:
    picture = f"![{part.title}]({part.picture})\n\n" if part.picture else ""
    return f"## {part.title}\n\n{part.asks}\n\n{picture}{part.text}\n"


def _to_html(claims: Sequence[Claim], parts: Sequence[Part], made: str, folder: Path) -> str:
    """Return the page; the first part is the claim table."""
    sections = [html_page.heading(TITLE, 1), html_page.note(made)]
    for number, part in enumerate(parts):
        sections += [html_page.heading(part.title), html_page.paragraph(part.asks.replace("*", ""))]
        if part.picture:
            png = (folder / part.picture).read_bytes()
            sections.append(html_page.picture(png, part.title))
        if number == 0:
            sections.append(html_page.table(HEAD, claim_cells(claims), words=True))
        else:
            sections.append(html_page.paragraph(part.text))
    return html_page.page(TITLE, sections)
