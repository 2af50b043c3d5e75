"""Exports of instruments, built to the description of each format: no measurement, and nobody's file."""

import struct

import numpy as np

FOOT = 0.3048


def flowtracker(places: list[float], depths: list[float], velocities: list[float]) -> str:
    """A FlowTracker .dis in English units: settings, then the table of stations, one point at 0.6 of the depth each."""
    lines = [
        "",
        "File_Name                        TEST.dis",
        "Start_Date_and_Time              2020/06/03 10:28:00",
        "Sensor_Type                      FlowTracker_Handheld_ADV",
        "Unit_System                      English Units",
        "",
        "St  Clock     Loc  Depth   IceD %Dep  MeasD Npts Spike     Vel   SNR Angle    Verr Bnd    Temp CorrFact MeanV",
        "()     ()     (ft)   (ft)  (ft) (*D)   (ft)   ()    ()   (ft/s)  (dB) (deg)  (ft/s)  ()  (degC)    ()  (ft/s)",
    ]
    for number, (at, depth, u) in enumerate(zip(places, depths, velocities, strict=True)):
        at, depth, u = at / FOOT, depth / FOOT, u / FOOT
        lines.append(
            f"{number:02d}  10:{28 + number}  {at:7.2f} {depth:6.2f}  0.000  0.6 {0.4 * depth:6.2f}  40   1 {u:7.3f}"
            f"  11.9    2   0.020   0   14.50  1.00 {u:7.3f}"
        )
    return "\n".join(lines)


def riversurveyor(places: list[float], depths: list[float], velocities: list[float]) -> str:
    """A .dis of RiverSurveyor Stationary Live in English units: settings, then a table by tabs."""
    lines = [
        "Discharge Measurement Summary", "Date Measured:Wednesday, June 3, 2020", "", "System Information",
        "System Type;RS-M9", "", "Units", "Distance; ft", "Velocity; ft/s", "Discharge; cfs", "", "Measurement Results",
        "\t".join(("#", "Time", "Location", "Water Surface Type", "Temperature", "Depth", "Flow Angle", "Mean Velocity",
                   "Area", "Station Q", "% Measured", "")),
    ]  # fmt: skip
    for number, (at, depth, u) in enumerate(zip(places, depths, velocities, strict=True), 1):
        numbers = (
            f"{at / FOOT:.2f}",
            "Open Water",
            "14.0",
            f"{depth / FOOT:.2f}",
            "-4.0",
            f"{u / FOOT:.3f}",
            "1",
            "1",
            "5",
        )
        lines.append("\t".join((str(number), "12:52:49 PM", *numbers, "")))
    return "\n".join([*lines, "", "Comments; "])


def winriver(
    east: np.ndarray, north: np.ndarray, depth, velocity, noise: float, seed: int = 3, reference: str = "BT"
) -> str:
    """Classic ASCII output of WinRiver II: a boat at (east, north) of its start, a power law in cells of 0.1 m.

    depth, velocity: of the whole transect, or of each ensemble (n,), (n, 2).
    """
    random, depths = np.random.default_rng(seed), np.broadcast_to(depth, east.shape)
    flows = np.broadcast_to(velocity, (east.size, 2))
    most = np.arange(0.3, 0.9 * depths.max(), 0.1).size
    lines = ["Test transect", "made to the format", f"10 25 15 {most} 1 100 1"]
    for number, (x, y, deep, flow) in enumerate(zip(east, north, depths, flows, strict=True), 1):
        cells = np.arange(0.3, 0.9 * deep, 0.1)
        lines += [
            f"20 6 3 10 28 {number % 60} 0 {number} 1 0.5 -0.3 120.0 14.5",
            f"-3.0 10.0 0.1 0.2 0 0 0 0 {deep:.2f} {deep:.2f} {deep:.2f} {deep:.2f}",
            f"{np.hypot(x, y):.2f} {number * 1.0} {y:.3f} {x:.3f} {np.hypot(x, y):.3f}",
            "30000 30000 -32768 -32768 0",
            "1.0 0.2 0.1 0 0 0 0 0.3 1.2",
            f"{cells.size} cm {reference} dB 0.43 0.139",
        ]
        for place in cells:
            shape = 7.0 / 6.0 * ((deep - place) / deep) ** (1.0 / 6.0)
            ve, vn = (100.0 * (shape * one + noise * random.standard_normal()) for one in flow)
            bad = number == 5 and place == cells[0]
            row = "-32768 -32768 -32768 -32768" if bad else f"{np.hypot(ve, vn):.2f} 90.0 {ve:.2f} {vn:.2f}"
            lines.append(f"{place:.2f} {row} 0.5 0.2 80 80 80 80 100 0.01")
    return "\n".join(lines)


def vectrino(mean: tuple[float, float, float], sd: float, samples: int, bad: int) -> str:
    """Samples of a Vectrino: the first `bad` of them of low correlation and no sense."""
    random = np.random.default_rng(5)
    lines = []
    for number in range(samples):
        u, v, w = (one + sd * random.standard_normal() for one in mean)
        if number < bad:
            u = -3.0
        correlation = 30 if number < bad else 95
        lines.append(
            f"{number / 25:.4f} {number} 0 {u:.4f} {v:.4f} {w:.4f} {w:.4f} 100 100 100 100 20 20 20 20 "
            + " ".join([str(correlation)] * 4)
        )
    return "\n".join(lines)


VECTRINO_HEADING = "[run.vno]\nNumber of measurements            1000\nSampling rate                         25 Hz\n"


def pd0(
    east: np.ndarray,
    north: np.ndarray,
    depth: float,
    velocity: tuple[float, float],
    noise: float,
    lost: tuple[int, ...] = (),
    unranged: tuple[int, ...] = (),
    cell: int = 10,
    first: int = 35,
    gps: bool = False,
    bed: tuple[float, float] = (0.0, 0.0),
) -> bytes:
    """A raw transect as a Rio Grande writes it: the boat of `winriver`, one ensemble a second, 0.2 m deep in the water.

    cell, first: size of the cells, and range of the first one [cm]; lost, unranged: ensembles, from 0, whose bottom
    track and whose ranges to the bottom are marked as lost; gps: with places from 46.5 N, 7 E on; bed: velocity of a
    bed that moves. Each has header, fixed and variable leader, velocities
    against the boat, three blocks of quality, bottom track, check sum.
    """
    random, cells, draft = np.random.default_rng(3), np.arange(30), 0.2
    boats = np.gradient(np.column_stack([east, north]), axis=0)
    ensembles = []
    for number, boat in enumerate(boats):
        own = noise * random.standard_normal((cells.size, 2))
        marks = number in lost, number in unranged
        place = (east[number], north[number]) if gps else None
        ensembles.append(
            _pd0_ensemble(number + 1, boat, depth, draft, cells, velocity, own, marks, cell, first, place, bed)
        )
    return b"".join(ensembles)


def _gga(number: int, east: float, north: float) -> bytes:
    """A fix as WinRiver II writes it (block 2022), on a sphere of 111.2 km a degree."""
    latitude, longitude = 46.5 + north / 111_200.0, 7.0 + east / (111_200.0 * np.cos(np.radians(46.5)))
    clock = f"10{number // 60:02d}{number % 60:02d}.00"
    fix = b"$GPGGA\0" + clock.encode().ljust(10, b"\0")
    fix += struct.pack("<dcdcBBffcfcfH", latitude, b"N", longitude, b"E", 2, 9, 0.9, 450.0, b"M", 48.0, b"M", 1.0, 0)
    return struct.pack("<HHHd", 0x2022, 104, len(fix), 0.0) + fix


def _pd0_ensemble(
    number, boat, depth, draft, cells, velocity, noise, marks, cell, first, place=None, bed=(0.0, 0.0)
) -> bytes:
    minute, second = divmod(number, 60)
    clock = (20, 6, 3, 10, minute, second, 0)
    # Rio Grande 10.16; beams of 20 degrees; the frame of the earth, tilts used.
    fixed = struct.pack("<H8B3H4BH4Bhh2BHH4BH",
                        0, 10, 16, 0x41, 0x41, 0, 13, 4, cells.size, 1, cell, 25, 1, 64, 5, 0, 1500,
                        0, 1, 0, 0x1F, 0, 0, 0x7D, 0x3D, first, 15, 1, 5, 50, 0, 5)  # fmt: skip
    fixed += struct.pack("<8xHBBIB", 0, 255, 0, 12345, 20)
    leader = struct.pack("<HH7BBHHHHhhhh3B3B8BIHIIB8B", 0x80, number, *clock, 0, 0, 1480, round(10 * draft), 0, 0, 0, 0,
                         1450, 0, 1, 0, 0, 0, 0, *[0] * 8, 0, 0, 0, 0, 0, 20, *clock)  # fmt: skip
    below = draft + 0.01 * (first + cell * cells)
    shape = 7.0 / 6.0 * (np.clip(depth - below, 0.0, None) / depth) ** (1.0 / 6.0)
    water = 1000.0 * (shape[:, None] * np.array(velocity) + noise - boat)
    rows = np.column_stack([water, np.zeros((cells.size, 2))]).round().astype("<i2")
    rows[below > 0.97 * depth] = -32768
    blocks = [fixed, leader, struct.pack("<H", 0x100) + rows.tobytes()]
    blocks += [
        struct.pack("<H", name) + bytes([value]) * rows.size
        for name, value in ((0x200, 120), (0x300, 90), (0x400, 100))
    ]
    lost, unranged = marks
    track = [-32768] * 4 if lost else [*(1000.0 * (np.array(bed) - boat)).round().astype(int).tolist(), 0, 0]
    bottom = (*[0 if unranged else round(100 * (depth - draft))] * 4, *track)
    blocks += [
        struct.pack("<3H4BHI4H4h", 0x600, 1, 0, 220, 30, 0, 5, 1000, 0, *bottom)
        + bytes([255] * 4 + [100] * 8 + [0] * 37)
    ]
    blocks += [_gga(number, *place)] if place is not None else []
    starts = np.cumsum([6 + 2 * len(blocks), *map(len, blocks)]).tolist()
    whole = struct.pack("<HHBB", 0x7F7F, starts[-1] + 2, 0, len(blocks)) + struct.pack(f"<{len(blocks)}H", *starts[:-1])
    whole += b"".join(blocks) + bytes(2)
    return whole + struct.pack("<H", sum(whole) & 0xFFFF)


def vector(mean: tuple[float, float, float], sd: float, samples: int, bad: int) -> bytes:
    """A binary record of a Vector: hardware, head and user configuration, header, then samples and, each second, the
    state of the instrument. 32 Hz, XYZ coordinates; the first `bad` samples of low correlation and no sense.
    """
    random, rate = np.random.default_rng(5), 32
    clock = bytes([0x28, 0x00, 0x03, 0x10, 0x20, 0x06])  # 3 June 2020, 10:28:00, each digit four bits
    user = bytearray(508)
    struct.pack_into("<H", user, 14, 512 // rate)  # time between samples, in 1/512 s
    struct.pack_into("<2H", user, 30, 1, 1)  # XYZ coordinates; one cell
    blocks = [
        _nortek(0x05, b"VEC 1234" + bytes(28) + b"3.35" + bytes(2), 48),
        _nortek(0x04, bytes(218), 224),
        _nortek(0x00, bytes(user[2:]), 512),
        _nortek(0x12, clock + struct.pack("<H", samples) + bytes(28), 42),
    ]
    for number in range(samples):
        if number % rate == 0:
            state = struct.pack("<2H3hhBBH", 120, 14800, 0, 0, 0, 1450, 0, 0, 0)
            blocks.append(_nortek(0x11, bytes([0x28, number // rate]) + clock[2:] + state, 28))
        sound = number >= bad
        velocity = [round(1000 * (one + sd * random.standard_normal())) if sound else -3000 for one in mean]
        body = struct.pack("<4B2H3h6B", 0, number % 256, 0, 0, 0, 0, *velocity, 90, 90, 90, *[95 if sound else 30] * 3)
        blocks.append(_summed(bytes([0xA5, 0x10]) + body))
    return b"".join(blocks)


def _nortek(name: int, body: bytes, size: int) -> bytes:
    """A block with its size in words of two bytes, and its check sum."""
    head = struct.pack("<BBH", 0xA5, name, size // 2)
    return _summed(head + body.ljust(size - 6, b"\0")[: size - 6])


def _summed(block: bytes) -> bytes:
    return block + struct.pack("<H", (0xB58C + sum(struct.unpack(f"<{len(block) // 2}H", block))) & 0xFFFF)
