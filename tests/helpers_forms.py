"""One recording in every form that a command takes: a car against a barrier, its first 60 ms."""

import numpy as np
from helpers_paths import BAGS

from crash_replay.bag import read_bag, write_bag
from crash_replay.recording import Recording

FORMS = ("bag", "folder of a bag", "csv", "ev5", "isomme", "nhtsa:99")
SPEED = 13.3  # m/s
G = 9.80665
STEP_US = 100


def short() -> Recording:
    whole = read_bag(BAGS / "frontal_single.mcap")
    kept = (whole.time_ns >= -5_000_000) & (whole.time_ns < 60_000_000)
    return Recording(whole.test, whole.time_ns[kept], whole.values[kept])


def every_form(folder, monkeypatch) -> dict[str, str]:
    """What is typed, by form; the test of NHTSA's database lies in the cache already."""
    recording = short()
    car, barrier = recording.column("car_ax") / G, recording.column("barrier_fx")
    write_bag(recording, folder / "a.mcap")
    write_bag(recording, folder / "b")
    table = np.column_stack([recording.time, car, barrier])
    np.savetxt(folder / "c.csv", table, fmt="%.12g", delimiter=",", header="time,car_ax,barrier_fx", comments="")
    (folder / "c.yaml").write_text(
        "channels:\n"
        "  car_ax: {quantity: acceleration, unit: g, body: car, axis: x}\n"
        "  barrier_fx: {quantity: force, unit: N, body: barrier}\n"
        f"initial_velocity: {{car: {SPEED}}}\n"
    )
    _ev5(folder / "cache" / "v00099", recording, car, barrier)
    monkeypatch.setenv("CRASH_CACHE", str(folder / "cache"))
    _isomme(folder / "mme", recording, car, barrier)
    typed = [folder / "a.mcap", folder / "b", folder / "c.csv", folder / "cache/v00099", folder / "mme", "nhtsa:99"]
    return dict(zip(FORMS, map(str, typed)))


def _ev5(folder, recording, car, barrier) -> None:
    folder.mkdir(parents=True)
    first, last = (int(recording.time_ns[k]) // (1000 * STEP_US) for k in (0, -1))
    made = [("1|1|AC|NA|VECG|XG|SEC|G'S", car, SPEED * 3.6), ("0|2|LC|NA|LC0101|XG|SEC|NWT", -barrier, 0.0)]
    lines = ["# Test Number: 99", "----- EV5 -----", "----- TEST -----"]
    lines += ["V5|A CAR|F|03/OCT/2017|LAB|C|R|NCA|VTB|CON|DRY|22|OTH|OTH|47.88|0|0|0|2|DAS", "----- VEHICLE -----"]
    lines += ["1|16|03|2018|M|4S|V|4CIF|2.5|AF|3000|1", "----- INSTRUMENTATION -----"]
    for number, (codes, values, speed) in enumerate(made, start=1):
        lines.append(f"{codes}|3000|M|D|100|9|{speed:.6f}|{first}|{last}|{STEP_US}|AM|P|NO COMMENTS")
        _numbers(folder / f"v00099.{number:03d}", np.column_stack([recording.time, values]), "%.12g\t%.12g")
    (folder / "v00099.EV5").write_text("\n".join([*lines, "----- END -----"]))


def _isomme(folder, recording, car, barrier) -> None:
    folder.mkdir()
    (folder / "t.mme").write_text(f"Test number :99\nVelocity test object 1 :{SPEED}\n")
    halves = [("B0LOCE010000FOXP", "N", barrier / 2), ("B0LOCE020000FOXP", "N", barrier / 2)]
    for number, (code, unit, values) in enumerate([("10VEHC000000ACXP", "g", car), *halves], start=1):
        header = {"Channel code": code, "Unit": unit, "Sampling interval": STEP_US * 1e-6,
                  "Time of first sample": recording.time[0]}  # fmt: skip
        text = "".join(f"{key} :{value}\n" for key, value in header.items())
        (folder / f"t.{number:03d}").write_text(text + "".join(f"{value:.12g}\n" for value in values))


def _numbers(path, table, form) -> None:
    np.savetxt(path, table, fmt=form)
