"""Summaries that QRev writes as XML: a discharge with its error, where the boat started."""

from pathlib import Path

import pytest

import vegglue
from vegglue.errors import InputError
from vegglue.importers.file_options import FileOptions
from vegglue.importers.instruments import reader_of
from vegglue.importers.qrev import read_qrev_summary
from vegglue.measurements.observations import read_observations

# The elements that are read, as QRev writes them, among others; no measurement.
SUMMARY = """\
<?xml version="1.0" encoding="utf-8"?>
<?xml-stylesheet type= "text/xsl" href="QRevStylesheet.xsl"?>
<Channel QRevFilename="mill_QRev" QRevVersion="QRevPy 4.01">
 <Transect><Discharge><Total type="double" unitsCode="cms">9.9</Total></Discharge></Transect>
 <ChannelSummary>
  <Discharge><Top type="double" unitsCode="cms">0.2</Top><Total type="double" unitsCode="cms">2.040</Total></Discharge>
  <Uncertainty><COV type="double">4.4</COV><Total type="double">8.0</Total></Uncertainty>
 </ChannelSummary>
</Channel>
"""
SITE = """\
channel: {length_m: 30, bottom_width_m: 3, bank_slope_v_per_h: 0.5, bed_slope: 0.001}
experiments: {June: {discharge: 2.0, level: 0.95}}
files: {mill_QRev.xml: {start: [12, 2]}}
"""


def test_a_summary_is_a_discharge_with_its_error(tmp_path: Path) -> None:
    (tmp_path / "mill_QRev.xml").write_text(SUMMARY, encoding="utf-8")
    (tmp_path / "site.yaml").write_text(SITE, encoding="utf-8")
    assert reader_of(tmp_path / "mill_QRev.xml") is read_qrev_summary
    table = read_observations(vegglue.import_folder(tmp_path, tmp_path / "mill.yaml")).table
    assert table["kind"].tolist() == ["discharge"]
    assert table["x"].tolist() == [12.0]
    assert table["value"].tolist() == [2.04]
    assert table["standard_error"].tolist() == pytest.approx([0.04 * 2.04])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("<Channel Q", '<!DOCTYPE a [<!ENTITY b "bb">]><Channel Q'), "got definitions of entities"),
        (("</Channel>", ""), "got no element found"),
        (("<ChannelSummary>", "<Summary>"), "mismatched tag"),
        ((">2.040<", ">many<"), "got could not convert string to float: 'many'"),
        (("<Total type", "<All type"), "mismatched tag"),
        (('unitsCode="cms">2', 'unitsCode="m">2'), "expected a unit of discharge, got 'm'"),
    ],
)
def test_another_summary_is_refused_in_one_sentence(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    path = tmp_path / "mill_QRev.xml"
    path.write_text(SUMMARY.replace(*change), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        reader_of(path)(path, FileOptions(start=(0.0, 0.0)))
    assert said in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_section_without_a_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mill_QRev.xml").write_text(SUMMARY, encoding="utf-8")
    with pytest.raises(InputError, match="expected where the boat started"):
        read_qrev_summary(tmp_path / "mill_QRev.xml", FileOptions())
