"""EV5 folders made by hand, in the form of NHTSA's own: two cars head on, headers that say NO COMMENTS."""

import numpy as np

STEP = 1e-4  # s
TIME = np.arange(-500, 2000) * STEP
MASSES = {1: 1200.0, 2: 1800.0}  # kg
SPEEDS = {1: 15.0, 2: 10.0}  # m/s, each along its own x: together they end at rest
G = 9.80665
BAD = 5  # number of the curve whose sensor is wrong


def pulse(vehicle: int) -> np.ndarray:
    """m/s^2 along the vehicle's own x: a half sine of 80 ms that ends its speed, equal forces on both."""
    size = SPEEDS[vehicle] * np.pi / (2.0 * 0.08)
    return np.where((TIME >= 0) & (TIME < 0.08), -size * np.sin(np.pi * TIME / 0.08), 0.0)


def ring(frequency: float, size: float) -> np.ndarray:
    """A panel's ringing, in m/s^2: high in the acceleration, nothing in the velocity."""
    return np.where(TIME >= 0.002, size * np.exp(-TIME / 0.03) * np.sin(2 * np.pi * frequency * TIME), 0.0)


def two_cars() -> list[tuple[str, np.ndarray]]:
    """Records of INSTRUMENTATION with their values: sensor, occupant, location, axis of each."""
    rng = np.random.default_rng(7)
    one, two = pulse(1), pulse(2)
    head = np.roll(one, 200) * 1.6
    made = [
        (1, "AC", "01", "HDCG", "XL", head),
        (1, "AC", "01", "CHST", "XL", np.roll(one, 120) * 1.3),
        (1, "AC", "01", "PVCN", "XL", np.roll(one, 80) * 1.1),
        (1, "AC", "NA", "SILL", "XG", one + ring(310.0, 60.0)),
        (1, "AC", "NA", "FLLR", "XG", one * 3.0 + ring(90.0, 700.0)),  # BAD: loose
        (1, "AC", "NA", "SILR", "XG", one + ring(280.0, 70.0)),
        (1, "AC", "NA", "FLRR", "XG", one + ring(250.0, 40.0)),
        (1, "AC", "NA", "TOEL", "XG", one * 1.03 + ring(120.0, 90.0)),
        (1, "AC", "NA", "ENGN", "XG", np.roll(one, -60) * 1.02),
        (2, "AC", "NA", "SILL", "XG", two + ring(300.0, 50.0)),
        (2, "AC", "NA", "SILR", "XG", two + ring(270.0, 50.0)),
        (2, "AC", "NA", "VECG", "XG", two + ring(240.0, 30.0)),
        (2, "AC", "02", "HDCG", "XL", np.roll(two, 200) * 1.5),
        (2, "DS", "02", "CHST", "XL", np.where(TIME > 0.02, -30e-3, 0.0)),
    ]
    records = []
    for number, (vehicle, sensor, occupant, location, axis, values) in enumerate(made, start=1):
        unit, factor = ("MM", 1e3) if sensor == "DS" else ("G'S", 1.0 / G)
        speed = 3.6 * SPEEDS[vehicle] if sensor == "AC" else 0.0
        record = (f"{vehicle}|{number}|{sensor}|{occupant}|{location}|{axis}|SEC|{unit}|3000|MAKER|01/JAN/2012|1000|9|"
                  f"{speed:.2f}|-500|1999|100|AM|P|NO COMMENTS")  # fmt: skip
        records.append((record, values * factor + rng.normal(scale=0.05 if sensor == "AC" else 0.0, size=len(TIME))))
    return records


def write_two_cars(folder, number: int = 7292, records=None):
    """The folder with its header and curve files."""
    folder.mkdir(exist_ok=True)
    test = "V5|TWO CARS HEAD ON|FRONTAL|11/MAY/2012|LAB|C|R|CMP|VTV|CON|DRY|22|OTH|OTH|90.0|0|0|0|14|DAS"
    lines = [f"# Source: NHTSA Vehicle Database - Test Number: {number}", "----- EV5 -----", "----- TEST -----", test]
    lines += ["----- VEHICLE -----", *(f"{k}|16|03|2012|M|4S|V|4CIF|2.5|AF|{mass:g}|1" for k, mass in MASSES.items())]
    lines += ["----- INSTRUMENTATION -----"]
    for record, values in two_cars() if records is None else records:
        lines.append(record)
        rows = (f"{t:.5f}\t{v:.5f}" for t, v in zip(TIME, values))
        (folder / f"v{number:05d}.{int(record.split('|')[1]):03d}").write_text("\n".join(rows) + "\n")
    (folder / f"v{number:05d}.EV5").write_text("\r\n".join([*lines, "----- END -----"]), encoding="latin-1")
    return folder
