"""Commands that are told can be copied as they stand."""

from pathlib import Path

from vegglue.cli.output import command_line


def test_a_command_that_is_told_can_be_copied() -> None:
    assert command_line("next", Path("brook.yaml")) == "vegglue next brook.yaml"
    assert command_line("run", Path("weir brook.yaml")) == "vegglue run 'weir brook.yaml'"
    told = command_line("extend", Path("brook.yaml"), "--auto", runs=Path("out"), trust=True)
    assert told == "vegglue extend brook.yaml --auto --runs out --trust"
