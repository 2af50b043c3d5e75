#!/bin/sh
# ras-commander and floodmodeller-api write Manning's n with three decimals: a step of 1 % changes nothing.
#
# Guess:      a roughness that is set in a HEC-RAS geometry or a Flood Modeller file, both with columns of eight or ten
#             characters, keeps at least its four digits: 0.0303 is read back as 0.0303.
# Seen:       both write 0.0303 as 0.030, and 0.0095, glass, as 0.009. Heights that ras-commander sets are in whole
#             centimetres. No message.
# Matters:    a calibration by differences of the model has slopes of zero for steps below 0.001, and an optimiser stops
#             where it began; the smooth bed of a flume is wrong by 5 %. In the file more digits may be written by hand.
# Documented: in ras-commander not in the docstring of set_mannings_n, but in that of the private function it calls;
#             no remark in floodmodeller-api.
# Versions:   ras-commander 0.110.1, floodmodeller-api 0.5.8.post1, pandas 2.3.1, numpy 2.2.6, scipy 1.16.0, h5py 3.14.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    ras-commander==0.110.1 floodmodeller-api==0.5.8.post1 pandas==2.3.1 numpy==2.2.6 scipy==1.16.0 h5py==3.14.0
cd "$work"
TMPDIR="$work" HOME="$work" timeout 200 "$work/venv/bin/python" -W ignore - 2> log <<'PYTHON' || { cat log; exit 1; }
import logging
from importlib.metadata import version
from pathlib import Path

import pandas as pd
from floodmodeller_api import DAT
from floodmodeller_api.units import RIVER
from ras_commander.geom.GeomCrossSection import GeomCrossSection

logging.disable()
BED = [(0.0, 1.0), (0.0, 0.004), (0.8, 0.004), (0.8, 1.0)]  # m; a flume 0.8 m wide
Path("flume.g01").write_text("\n".join([
    "Geom Title=Flume", "Program Version=6.50", "", f"River Reach={'Flume':16},{'Whole':16}",
    "Type RM Length L Ch R = 1 ,10      ,1,1,1", f"#Sta/Elev= {len(BED)} ",
    "".join(f"{station:8.4f}{height:8.4f}" for station, height in BED), "#Mann= 1 , 0 , 0 ",
    f"{0.0:8.2f}{0.0200:8.4f}{0:8d}", "Bank Sta=0,0.8", "Exp/Cntr=0.3,0.1", ""]))
WHERE = ("flume.g01", "Flume", "Whole", "10")


def by_hec_ras(roughness):
    GeomCrossSection.set_mannings_n(*WHERE, pd.DataFrame({"Station": [0.0], "n_value": [roughness]}))
    return float(GeomCrossSection.get_mannings_n(*WHERE)["n_value"].iloc[0])


def by_flood_modeller(roughness):
    columns = ["X", "Y", "Mannings n", "Panel", "RPL", "Marker", "Easting", "Northing", "Deactivation", "SP. Marker"]
    section = [[station, height, roughness, False, 1.0, "", 0.0, 0.0, "", 0] for station, height in BED]
    flume = DAT()
    flume.insert_unit(RIVER(name="S1", data=pd.DataFrame(section, columns=columns)), add_at=-1)
    flume.save("flume.dat")
    return float(DAT("flume.dat").sections["S1"].data["Mannings n"].iloc[0])


by_hand = float(GeomCrossSection.get_mannings_n(*WHERE)["n_value"].iloc[0])
set_n = (0.0300, 0.0303, 0.0095)
ras, flood = [by_hec_ras(one) for one in set_n], [by_flood_modeller(one) for one in set_n]
GeomCrossSection.set_station_elevation(*WHERE, pd.DataFrame(BED[1:3], columns=["Station", "Elevation"]))
bed = float(GeomCrossSection.get_station_elevation(*WHERE)["Elevation"].min())
print(f"ras-commander {version('ras-commander')}, floodmodeller-api {version('floodmodeller-api')}: n set to {set_n}")
print("expected: the same numbers, and a bed at 0.004 m")
print(f"seen: {ras} in HEC-RAS with a bed at {bed} m, {flood} in Flood Modeller")
assert by_hand == 0.02
assert ras[0] == ras[1] == flood[0] == flood[1] == 0.030, "the behaviour has changed"
assert ras[2] == flood[2] == 0.009 and bed == 0.0, "the behaviour has changed"
PYTHON
