"""A page as a file: one self-contained HTML file that needs no network, filled from a template beside this file."""

import html
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2

from vegglue.pages.style import palette_css
from vegglue.whole_files import MAKE_ROOM, write_file

# What is inlined in every page, from the files beside this one.
STYLE, SCRIPT = "page.css", "sections.js"


def write_page(path: Path, page: Callable[[], str]) -> Path:
    """Write what `page` makes, which may write pictures on its way; a page that was there stays until it is whole.

    Errors: StorageError when a file cannot be written.
    """
    write_file(path, page().encode(), MAKE_ROOM)
    return path


def rendered(template: str, **values: Any) -> str:
    """A page of a template of this folder, with the palette, the style and the script of all pages."""
    light, dark = palette_css()
    shared = {"light": light, "dark": dark, "style": _beside(STYLE), "script": _beside(SCRIPT)}
    return _environment().get_template(template).render(**shared, **values)


def set_as_code(text: str) -> str:
    """HTML with commands in `backticks` set as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text)


def _beside(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["set_as_code"] = lambda text: set_as_code(html.escape(text))
    return environment
