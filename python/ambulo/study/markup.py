"""HTML: text escaped where it enters, and the parts that the page is put together from."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from urllib.parse import quote

from ambulo.study.tables import Tally

Attribute = str | int | None
"""Of an element; one that is `None` is left out."""


class Markup(str):
    """Text that is HTML already. All other text is escaped where it enters."""


def join(parts: Iterable[Markup]) -> Markup:
    """Parts that are not empty, a line each."""
    return Markup("\n".join(part for part in parts if part))


def tag(name: str, *content: str, **attributes: Attribute) -> Markup:
    """An element; content is escaped unless it is `Markup`. `class_` stands for `class`."""
    inside = "".join(c if isinstance(c, Markup) else html.escape(c, quote=False) for c in content)
    return Markup(f"{void(name, **attributes)}{inside}</{name}>")


def void(name: str, **attributes: Attribute) -> Markup:
    """An element that has no content and no end."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{name}{written}>")


# Texts --------------------------------------------------------------------------------------


def note(*content: str) -> Markup:
    """Small print."""
    return tag("p", *content, class_="note")


def csv_link(file: str) -> Markup:
    """Leads from a table to its file."""
    return tag("a", "This table as CSV", href=quote(file))


def definitions(pairs: Iterable[tuple[str, str]], class_: str) -> Markup:
    """Names and what is said of them."""
    rows = (tag("div", tag("dt", name), tag("dd", text)) for name, text in pairs)
    return tag("dl", *rows, class_=class_)


def yes_no(usable: bool | None, yes: str = "yes", no: str = "no") -> Markup:
    """A verdict under a heading that says what is asked."""
    if usable is None:
        return Markup("–")
    words = f"✓ {yes}" if usable else f"✗ {no}"
    return tag("span", words, class_="yes" if usable else "no")


def verdict(usable: bool) -> Markup:
    """As `yes_no`, where no heading says what is asked."""
    return yes_no(usable, "usable", "not usable")


# Pictures -----------------------------------------------------------------------------------


def picture(
    file: str, alt: str, size: tuple[int, int] | None, loading: str | None = None
) -> Markup:
    """An image of this folder; one with `loading="lazy"` is read when it comes into view."""
    width, height = size or (None, None)
    return void("img", src=quote(file), alt=alt, width=width, height=height, loading=loading)


def figure(
    image: Markup, name: str, about: str, *more: Markup, class_: str | None = None
) -> Markup:
    """An image with its caption."""
    caption = tag("figcaption", tag("b", name), tag("span", about, class_="note"), *more)
    return tag("figure", image, caption, class_=class_)


def dot(run: int) -> Markup:
    """In the colour of the first, second or third run."""
    return tag("i", class_=f"dot run{run}", aria_hidden="true")


def bar(tally: Tally) -> Markup:
    """A count and its share as a bar."""
    if not tally.of:
        return Markup("–")
    full = f"width:{100 * tally.count / tally.of:.0f}%"
    share = tag("span", tag("i", style=full), class_="bar", aria_hidden="true")
    return tag("span", str(tally), share, class_="tally")


# Tables -------------------------------------------------------------------------------------


def table(head: Sequence[Markup], body: Sequence[Markup], label: str) -> Markup:
    """A table that scrolls sideways where the page is narrower."""
    whole = tag("table", tag("thead", *head), *body)
    return tag("div", whole, class_="scroll", role="region", aria_label=label, tabindex=0)


def heads(*names: str) -> Markup:
    """A row of column headings; a name that begins with `>` is that of a column of numbers."""
    cells = (
        tag("th", name.lstrip(">"), scope="col", class_="number" if name[0] == ">" else None)
        for name in names
    )
    return tag("tr", *cells)


def group_heads(before: int, groups: Mapping[str, int]) -> Markup:
    """A row above it: after some columns without a group, each group and its columns."""
    cells = (
        tag("th", name, colspan=columns, scope="colgroup", class_="group")
        for name, columns in groups.items()
    )
    return tag("tr", tag("td", colspan=before), *cells)


def number(text: str, first: bool = False) -> Markup:
    """A cell of a column of numbers, which may be the first of its group."""
    return tag("td", text, class_="number first" if first else "number")
