"""A page in a headless browser: what a small script finds in it, at a given width, and what the console says."""

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path
from typing import Any

import pytest

# Programs that are Chromium, by their usual names.
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
# Before anything of the page runs.
LISTEN = """
<script>
window.complaints = [];
window.addEventListener("error", (event) => window.complaints.push(event.message));
for (const kind of ["error", "warn"]) console[kind] = (...words) => window.complaints.push(words.join(" "));
</script>
"""
# A window is never narrower than some 500 px: the page stands in a frame of the width that is asked for.
FRAME = """<!doctype html><title>frame</title><body style="margin:0">
<iframe id="page" src="{name}" style="width:{width}px;height:900px;border:0"></iframe>
<pre id="found">nothing was found</pre>
<script>
document.getElementById("page").addEventListener("load", () => {{
  const page = document.getElementById("page").contentWindow, document_ = page.document;
  let told;
  try {{ told = (({script}))(page, document_); }} catch (error) {{ told = {{ failed: String(error) }}; }}
  document.getElementById("found").textContent = JSON.stringify({{ told, complaints: page.complaints }});
}});
</script>
"""


def browser() -> str:
    """The program; the test is skipped where there is none."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("no Chromium is installed here: the page is not looked at in a browser")
    return found


def found_in_page(page: Path, width: int, script: str) -> Any:
    """What script, a JavaScript function of (window, document), returns in the page at so many px.

    Nothing may have been complained of on the console, nor on the way.
    """
    copy, frame = page.with_name("copy.html"), page.with_name("frame.html")
    text = page.read_text(encoding="utf-8")
    copy.write_text(text.replace("<head>", f"<head>{LISTEN}", 1), encoding="utf-8")
    frame.write_text(FRAME.format(name=copy.name, width=width, script=script), encoding="utf-8")
    command = [
        browser(), "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files",
        "--virtual-time-budget=10000", f"--window-size={max(width, 800)},1000", "--dump-dom", frame.as_uri(),
    ]  # fmt: skip
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = re.search(r'<pre id="found">(.*?)</pre>', shown, re.DOTALL)
    assert found, shown[-500:]
    answer = json.loads(unescape(found[1]))
    assert answer["complaints"] == []
    assert "failed" not in (answer["told"] or {}), answer["told"]
    return answer["told"]
