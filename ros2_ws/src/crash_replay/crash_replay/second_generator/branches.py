"""What acts beside an element's curve. Compression positive: x crush in m, v its rate in m/s, force in N.

A branch has `size` internal states z, integrated with the motion (`flow`: dz/dt), and a mode that changes only where
one of its `guards` falls through zero. The machine locates that instant and asks `switched` for the new mode; between
two such instants every law is smooth.
"""

from dataclasses import dataclass
from math import exp, tanh

from .curves import Curve

Z = tuple[float, ...]


class Branch:
    """Nothing: a base with no states and no modes."""

    size = 0
    elastic = False  # whether it pushes also while a one-way element is apart (its own spring between the bodies)

    def start(self, v: float) -> int:
        return 1 if v >= 0.0 else -1

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        raise NotImplementedError

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        return ()

    def guards(self, x: float, v: float, z: Z, mode: int) -> Z:
        return ()

    def switched(self, guard: int, x: float, v: float, z: Z, mode: int) -> int:
        return mode


class Turning(Branch):
    """A law with a kink where the rate changes sign: mode 1 while compressing, -1 while extending."""

    def guards(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (v * mode,)

    def switched(self, guard: int, x: float, v: float, z: Z, mode: int) -> int:
        return -mode


# --- friction


@dataclass(frozen=True)
class DryFriction(Branch):
    """Coulomb's law (1785) with sticking: f sign(v) while it slips; while it sticks whatever holds v = 0, up to f.

    Modes 1 and -1 slip, 0 sticks. What holds is found by the machine from the balance of both bodies (D. Karnopp, J.
    Dyn. Syst. Meas. Control 107, 1985, without his band of velocities: the instant is located).
    """

    f: float

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.f * mode

    def guards(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (v * mode,) if mode else ()


@dataclass(frozen=True)
class TanhFriction(Branch):
    """F = f tanh(v / v0), as it is written where no solver may meet a jump."""

    f: float
    v0: float

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.f * tanh(v / self.v0)


@dataclass(frozen=True)
class Dahl(Turning):
    """F = f z, dz/dt = v (1 - z sign v) / d (P. Dahl, Aerospace Corp. TOR-0158, 1968); d: the travel before slip, m."""

    f: float
    d: float
    size = 1

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.f * z[0]

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (v * (1.0 - z[0] * mode) / self.d,)


@dataclass(frozen=True)
class LuGre(Turning):
    """F = s0 z + s1 dz/dt + s2 v, dz/dt = v - s0 |v| z / g, g = f + (fs - f) exp(-(v / vs)^2).

    C. Canudas de Wit and others, IEEE Trans. Autom. Control 40 (1995), equations 2 to 5; z in m.
    """

    f: float
    fs: float
    vs: float
    s0: float
    s1: float
    s2: float
    size = 1

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        g = self.f + (self.fs - self.f) * exp(-((v / self.vs) ** 2))
        return (v - self.s0 * v * mode * z[0] / g,)

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.s0 * z[0] + self.s1 * self.flow(x, v, z, mode)[0] + self.s2 * v


# --- dampers


@dataclass(frozen=True)
class Dashpot(Branch):
    """F = c v."""

    c: float

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.c * v


@dataclass(frozen=True)
class DeepeningDashpot(Branch):
    """F = b x v: what touches presses on a larger surface the deeper it is (Hunt and Crossley 1975)."""

    b: float

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.b * x * v


@dataclass(frozen=True)
class Orifice(Turning):
    """F = q v |v|: a fluid pressed through a hole (Bernoulli)."""

    q: float

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.q * v * abs(v)


@dataclass(frozen=True)
class MeteringPin(Turning):
    """F = c v |v| / (1 - x / l)^2: an orifice that closes with its travel, as of a buffer with a metering pin."""

    c: float
    length: float

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.c * v * abs(v) / max(1.0 - max(x, 0.0) / self.length, 0.05) ** 2


# --- elastic, beside the curve


@dataclass(frozen=True)
class SpringBeside(Branch):
    """An elastic curve of its own beside the element: it gives back all it takes. Both ways where `both`."""

    curve: Curve
    both: bool = False
    elastic = True

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        if x >= 0.0:
            return self.curve.force(x)
        return -self.curve.force(-x) if self.both else 0.0


# --- hysteresis


@dataclass(frozen=True)
class BoucWen(Turning):
    """F = f z, dz/dt = (v - |z|^n (b |v| sign z + (1 - b) v)) / d.

    Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976), with A = 1; d in m is the travel to yield and b the shape of its
    loop.
    """

    f: float
    d: float
    n: float
    b: float
    size = 1

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.f * z[0]

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        across = self.b * (1.0 if v * z[0] >= 0.0 else -1.0) + (1.0 - self.b)
        return (v * (1.0 - abs(z[0]) ** self.n * across) / self.d,)


@dataclass(frozen=True)
class Slider(Branch):
    """A spring f / d in series with a dry slider that yields at f (G. Masing 1926; W. Iwan 1966). Mode 0 holds."""

    f: float
    d: float
    size = 1

    def start(self, v: float) -> int:
        return 0

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.f * z[0]

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (0.0,) if mode else (v / self.d,)

    def guards(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (v * mode,) if mode else (1.0 - z[0], 1.0 + z[0])

    def switched(self, guard: int, x: float, v: float, z: Z, mode: int) -> int:
        return 0 if mode else (1, -1)[guard]
