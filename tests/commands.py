"""Commands for tests: small programs in place of another code, which start in a few hundredths of a second."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from socketserver import StreamRequestHandler, ThreadingTCPServer
from threading import Lock, Thread

import numpy as np
from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import sample_of
from vegglue.case.schema import Case
from vegglue.inference.solve_ensemble import solve_chunk
from vegglue.measurements.observations import read_observations

# Python without site packages: nothing of vegglue is loaded, as in another code.
BARE = f"{sys.executable} -I -S"
# u = (n_b phi^0.1 + x / 1000) of the station: smooth in both parameters, and no flow at all.
SMOOTH = """
import csv, json
given = json.load(open("parameters.json"))["parameters"]
n, phi = given["n_b"]["value"], given["phi"]["value"]
with open("stations.csv") as file:
    rows = list(csv.DictReader(file))
with open("predictions.csv", "w") as file:
    file.write("station,prediction\\n")
    for row in rows:
        file.write(f"{row['station']},{0.2 / n**0.5 - 0.05 * phi**0.2 + float(row['x']) / 1000!r}\\n")
"""


def commanded(folder: Path, program: str = SMOOTH, engine: str = "", *changes: tuple[str, str]) -> Case:
    """The brook of the docs with a program as its engine; engine: further keys of it."""
    (folder / "model.py").write_text(program, encoding="utf-8")
    told = f'engine: {{command: "{BARE} {{model}}", files: {{model: model.py}}{engine}}}'
    return load_case(write_reach(folder, ("name: brook", f"name: brook\n{told}"), *changes), trust=True)


# Hands the folder it is started in to whoever listens, and waits: the work is done there, without a start of its own.
CLIENT = """
import os, socket, sys
with socket.create_connection(("127.0.0.1", int(sys.argv[1]))) as line:
    line.sendall((os.getcwd() + "\\n").encode())
    said = line.makefile().readline().strip()
sys.exit(said if said != "done" else 0)
"""
# Predictions of all stations, from the values of the parameters.
Predict = Callable[[dict[str, float]], np.ndarray]


@contextmanager
def served(predict: Predict) -> Iterator[int]:
    """The port of a server that predicts for commands of CLIENT; a ValueError of it is how a command fails."""
    one_at_a_time = Lock()

    class Member(StreamRequestHandler):
        def handle(self) -> None:
            folder = Path(self.rfile.readline().decode().rstrip("\n"))
            given = json.loads((folder / "parameters.json").read_text(encoding="utf-8"))["parameters"]
            try:
                with one_at_a_time:
                    found = predict({name: one["value"] for name, one in given.items()})
            except ValueError as error:
                self.wfile.write(f"{error}\n".encode())
                return
            rows = "".join(f"{station},{float(value)!r}\n" for station, value in enumerate(found))
            (folder / "predictions.csv").write_text(f"station,prediction\n{rows}", encoding="utf-8")
            self.wfile.write(b"done\n")

    with ThreadingTCPServer(("127.0.0.1", 0), Member) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()


def built_in(case: Case) -> Predict:
    """The solver of the package as another's code: one member at a time."""
    site, observations = build_site(case), read_observations(case)

    def predict(theta: dict[str, float]) -> np.ndarray:
        sample = sample_of(case, {name: np.array([value]) for name, value in theta.items()})
        rows = solve_chunk(case, site, observations, sample)
        if rows["reason"][0]:
            raise ValueError(rows["reason"][0])
        return np.asarray(rows["prediction"][0])

    return predict


def by_server(config: Path, port: int, name: str = "own") -> Case:
    """A child of a config whose engine is a client of the server."""
    (config.parent / "client.py").write_text(CLIENT, encoding="utf-8")
    child = config.with_name(f"{name}.yaml")
    engine = f'engine: {{command: "{BARE} {{client}} {port}", files: {{client: client.py}}}}'
    child.write_text(f"extends: {config.name}\nname: {name}\n{engine}\n", encoding="utf-8")
    return load_case(child, trust=True)
