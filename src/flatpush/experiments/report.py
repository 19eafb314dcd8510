"""The report of all experiments as one page: ours beside the paper's, every figure within, nothing to fetch."""

import base64
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from itertools import groupby

from .everything import SECTIONS, Done, Section
from .finding import COLUMNS, Finding, Row

STYLE = """
:root { --ink: #1a1a1a; --soft: #5a5a5a; --line: #dcdcdc; --paper: #ffffff; --tint: #f6f6f4; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 64rem; background: var(--paper); color: var(--ink);
  font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .4rem; }
h2 { font-size: 1.25rem; margin: 3rem 0 .3rem; padding-top: .8rem; border-top: 2px solid var(--ink); }
p { margin: .3rem 0 .9rem; }
p.about, footer { color: var(--soft); }
nav ol { columns: 2; padding-left: 1.4rem; margin: 1rem 0 0; } nav li { break-inside: avoid; }
a { color: #0061b5; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .86rem; }
th, td { text-align: left; vertical-align: top; padding: .45rem .6rem; border-bottom: 1px solid var(--line); }
th { background: var(--tint); } td:nth-child(1) { width: 26%; } td:nth-child(2) { width: 20%; }
td:nth-child(3) { width: 27%; font-weight: 600; } td:nth-child(4) { color: var(--soft); }
figure { margin: 1.2rem 0; } figure img { width: 100%; max-width: 48rem; height: auto; display: block; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(22rem, 1fr)); gap: 0 1.2rem; }
.missing { background: #fff4d6; padding: .6rem .8rem; border-left: 4px solid #e0a100; }
summary { cursor: pointer; color: var(--soft); margin-top: .8rem; }
pre { overflow-x: auto; font-size: .78rem; line-height: 1.35; background: var(--tint); padding: .8rem; }
@media (max-width: 40rem) { nav ol { columns: 1; } .pictures { grid-template-columns: 1fr; }
  table { min-width: 44rem; } }
@media print { details { display: none; } }
"""
MANY = 2  # more figures than this stand side by side


def page(found: Mapping[str, Done], machine: str, quick: bool) -> str:
    """The page.

    Args:
        found: in each section, by its name; those that are not there yet are said to be.
        machine: on which, and with which version, for the foot of the page.
        quick: whether fewer runs were made, which the head says.
    """
    sections = [(section, found.get(section.name)) for section in SECTIONS]
    links = "".join(f'<li><a href="#{s.name}">{escape(s.title)}</a></li>' for s, _ in sections)
    hurried = " This is the quick edition: fewer random runs, and no fits to recorded runs." if quick else ""
    body = "".join(_section(section, done) for section, done in sections)
    cpu = sum(done.cpu for done in found.values())
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Pushing Revisited, recomputed by flatpush</title><style>{STYLE}</style></head><body>"
        "<header><h1>“Pushing Revisited”, recomputed</h1>"
        "<p>Every figure, the proposition and the theorem of J. Zhou, Y. Hou and M. T. Mason, “Pushing Revisited:"
        " Differential Flatness, Trajectory Planning and Stabilization” (2017), computed by flatpush: what the paper"
        f" says, what comes out here, and why they differ.{hurried}</p></header><nav><ol>{links}</ol></nav>"
        f"<main>{body}</main><footer><p>{escape(machine)}; {cpu:.0f} s of CPU time in all.</p></footer></body></html>\n"
    )


def _section(section: Section, done: Done | None) -> str:
    found = (
        done.finding if done is not None else Finding(missing="This is not computed yet, or was interrupted.")
    )
    told = found.missing or (found.failed and f"This experiment failed: {found.failed}")
    inside = (f'<p class="missing">{escape(told)}</p>' if told else "") + _content(found)
    return (
        f'<section id="{section.name}"><h2>{escape(section.title)}</h2>'
        f'<p class="about">{escape(section.about)}</p>{inside}</section>'
    )


def _content(found: Finding) -> str:
    parts = []
    if found.rows:
        head = "".join(f"<th>{name}</th>" for name in COLUMNS)
        rows = "".join(f"<tr>{cells}</tr>" for cells in _cells(found.rows))
        parts.append(
            f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
        )
    figures = "".join(_figure(name, svg) for name, svg in found.figures)
    if figures:
        parts.append(f'<div class="pictures">{figures}</div>' if len(found.figures) > MANY else figures)
    if found.table:
        parts.append(
            f"<details><summary>What the command prints</summary><pre>{escape(found.table)}</pre></details>"
        )
    return "".join(parts)


def _cells(rows: Sequence[Row]) -> Iterator[str]:
    """The cells of each row; a reason that rows in sequence share stands once, beside all of them."""
    for why, group in groupby(rows, key=lambda row: row.why):
        same = list(group)
        for k, row in enumerate(same):
            cells = "".join(f"<td>{escape(value) or '—'}</td>" for value in (row.what, row.paper, row.ours))
            yield cells + (f'<td rowspan="{len(same)}">{escape(why) or "—"}</td>' if k == 0 else "")


def _figure(name: str, svg: str) -> str:
    # As an image, a figure keeps its identifiers and styles to itself.
    data = base64.b64encode(svg.encode("utf-8")).decode("ascii")
    return f'<figure><img alt="{escape(name)}" src="data:image/svg+xml;base64,{data}"></figure>'
