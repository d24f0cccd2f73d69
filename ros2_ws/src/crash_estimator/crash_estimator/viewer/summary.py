"""A table of errors and parameters that is kept up to date."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from crash_replay.foreign_text import markdown

from .blocks import ParameterBlock, ResidualBlock
from .cast import Cast
from .noise import NoiseFloor
from .pen import Pen
from .units import with_std

Key = tuple[str, str]  # (estimator, equation or parameter)


class Summary:
    """Adds up what the table says; `write` logs it."""

    def __init__(self, pen: Pen, noise: NoiseFloor):
        self.pen = pen
        self.noise = noise
        self.errors: dict[Key, np.ndarray] = {}  # [samples, sum of squared residuals]
        self.parameters: dict[Key, tuple[float, float]] = {}
        self.time_ns = 0
        self.incomplete = ""  # what the whole recording lacks

    def add_residuals(self, block: ResidualBlock) -> None:
        """From the impact on."""
        after = block.time_ns >= 0
        for k, body in enumerate(block.name):
            residual = block.residual[after, k]
            sums = np.array([np.isfinite(residual).sum(), np.nansum(residual**2)], dtype=float)
            self.errors[block.estimator, body] = self.errors.get((block.estimator, body), 0.0) + sums
        self.time_ns = max(self.time_ns, int(block.time_ns[-1]))

    def add_parameters(self, block: ParameterBlock) -> None:
        for k, name in enumerate(block.name):
            self.parameters[block.estimator, name] = (float(block.value[-1, k]), float(block.std[-1, k]))

    def write(self, cast: Cast) -> None:
        document = rr.TextDocument(self.text(cast), media_type="text/markdown")
        self.pen.recording.set_time("crash_time", duration=np.timedelta64(self.time_ns, "ns"))
        self.pen.recording.log("summary", document)

    def text(self, cast: Cast) -> str:
        """Markdown: rows are equations and parameters, columns estimators."""
        names = cast.names
        lines = [f"**{markdown(cast.test.id)}** {markdown(cast.test.title)}", ""]
        lines += [row("", [cast.label(name) for name in names]), "|---|" + "---:|" * len(names)]
        lines.append(row("model", [m.model for m in cast.members]))
        lines.append(row("method", [m.method for m in cast.members]))
        lines.append(_group("RMS residual", len(names)))
        for body, unit in cast.equations:
            shown = cast.shown(unit)
            lines.append(row(f"{body}, {shown.unit}", [self._rms(name, body, shown.factor) for name in names]))
        lines.append(_group("parameter ± σ", len(names)))
        for parameter, unit in cast.parameters:
            shown = cast.shown(unit)
            cells = [self._parameter(name, parameter, shown.factor) for name in names]
            symbol = parameter.replace(".stiffness", " K").replace(".damping", " C")
            lines.append(row(f"{symbol}, {shown.unit}", cells))
        lines.append(_group("RMS residual / noise", len(names)))
        for body, _ in cast.equations:
            lines.append(row(body, [self._times_the_noise(name, body) for name in names]))
        lines += ["", f"**incomplete:** {markdown(self.incomplete)}"] * bool(self.incomplete)
        return "\n".join(lines)

    def _rms(self, name: str, body: str, factor: float) -> str:
        count, squares = self.errors.get((name, body), (0.0, 0.0))
        return f"{factor * np.sqrt(squares / count):.3g}" if count else "–"

    def _times_the_noise(self, name: str, body: str) -> str:
        """1: nothing but noise is left."""
        noise = self.noise.known(body)
        return self._rms(name, body, 1.0 / noise) if noise > 0.0 else "–"

    def _parameter(self, name: str, parameter: str, factor: float) -> str:
        if (name, parameter) not in self.parameters:
            return "–"
        value, std = (factor * x for x in self.parameters[name, parameter])
        return with_std(value, std)


def row(title: str, cells: list[str]) -> str:
    """Of a Markdown table; what is in it has no markup."""
    return f"| {markdown(title)} | " + " | ".join(map(markdown, cells)) + " |"


def _group(title: str, columns: int) -> str:
    return f"| **{title}** |" + " |" * columns


def summary_view() -> rrb.View:
    return rrb.TextDocumentView(origin="summary", name="errors and parameters")
