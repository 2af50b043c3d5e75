"""Builds the wheel and the source distribution of a release in dist/, twice, and checks them; uploads nothing.

    make release

Both have the same bytes on each build: files are dated by SOURCE_DATE_EPOCH, the day of the release in CHANGELOG.md if
it is not set.
"""

import gzip
import hashlib
import io
import os
import re
import subprocess
import sys
import tarfile
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]


def release_day(changes: str) -> int:
    """The day of the newest release, in seconds since 1970."""
    found = re.search(r"^## \S+, (\d{4}-\d{2}-\d{2})$", changes, re.MULTILINE)
    if found is None:
        raise SystemExit("CHANGELOG.md: expected a heading `## VERSION, YYYY-MM-DD`, found none.")
    return int(datetime.fromisoformat(found[1]).replace(tzinfo=UTC).timestamp())


def dated(archive: Path, seconds: int) -> bytes:
    """A .tar.gz with sorted files of one date and no owner: setuptools dates an sdist by its files and the clock."""
    content = io.BytesIO()
    with (
        tarfile.open(archive) as old,
        gzip.GzipFile(filename="", fileobj=content, mode="wb", mtime=seconds) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as new,
    ):
        for entry in sorted(old.getmembers(), key=lambda one: one.name):
            entry.mtime, entry.uid, entry.gid, entry.uname, entry.gname, entry.pax_headers = seconds, 0, 0, "", "", {}
            new.addfile(entry, old.extractfile(entry) if entry.isfile() else None)
    return content.getvalue()


def build(into: Path, seconds: int) -> dict[str, bytes]:
    """Name and content of the wheel and of the source distribution."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(into)]
    environment = os.environ | {"SOURCE_DATE_EPOCH": str(seconds)}
    subprocess.run(command, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    made = sorted(into.iterdir())
    return {path.name: dated(path, seconds) if path.name.endswith(".tar.gz") else path.read_bytes() for path in made}


def main() -> None:
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH") or release_day((ROOT / "CHANGELOG.md").read_text("utf-8")))
    with TemporaryDirectory() as first, TemporaryDirectory() as second:
        made, again = build(Path(first), seconds), build(Path(second), seconds)
    if made != again:
        raise SystemExit(f"Two builds differ: {[name for name in made if made[name] != again.get(name)]}")
    files = [ROOT / "dist" / name for name in made]
    files[0].parent.mkdir(exist_ok=True)
    for path in files:
        path.write_bytes(made[path.name])
    subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *map(str, files)], check=True)
    for path in files:
        print(f"{hashlib.sha256(made[path.name]).hexdigest()}  {path.relative_to(ROOT)}")
    shown = " ".join(str(path.relative_to(ROOT)) for path in files)
    print(f"Built twice with the same bytes, checked, not uploaded: `twine upload {shown}`")


if __name__ == "__main__":
    main()
