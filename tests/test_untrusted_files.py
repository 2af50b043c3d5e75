"""Whatever bytes a file holds, its reader makes a value of them or says one sentence, soon."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from untrusted import READERS, SNIPPETS, Reader, edited, outcome

EDITS = st.lists(
    st.tuples(st.integers(0, 4000), st.integers(0, 30), st.sampled_from(SNIPPETS) | st.binary(max_size=12)), max_size=4
)
# Few: the suite is run often. `make fuzz` tries for as long as it is let.
EXAMPLES = 40
OF_READERS = pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
SOME = settings(
    max_examples=EXAMPLES, deadline=20_000, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip


@OF_READERS
def test_the_valid_file_is_read(reader: Reader, tmp_path: Path) -> None:
    assert outcome(reader, tmp_path, reader.valid) == ""


@pytest.mark.slow
@OF_READERS
@SOME
@given(edits=EDITS)
def test_an_edited_file_is_read_or_refused(reader: Reader, tmp_path: Path, edits: list[tuple[int, int, bytes]]) -> None:
    assert len(outcome(reader, tmp_path, edited(reader.valid, edits)).splitlines()) <= 1


@pytest.mark.slow
@OF_READERS
@SOME
@given(content=st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode(errors="surrogatepass")))
def test_any_bytes_are_read_or_refused(reader: Reader, tmp_path: Path, content: bytes) -> None:
    assert len(outcome(reader, tmp_path, content).splitlines()) <= 1
