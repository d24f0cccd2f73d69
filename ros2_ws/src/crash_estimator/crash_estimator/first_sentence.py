"""What a crash engineer would write first of a test and its model: does it hold, how well, and what does it lack."""

from crash_replay.gravity import G

from .core.diagnosis import Diagnosis

AT_THE_NOISE = 1.1
"""Times the sensors' noise: an error below it is noise to any engineer."""


def first_sentence(found: Diagnosis, model: str, test: str) -> str:
    rms = found.residual_rms
    before, after, floor = (f"{value / G:.3g} g" for value in (rms.before, rms.after, rms.noise_floor))
    if found.verdict == "adequate" and not found.steps:
        if rms.before <= AT_THE_NOISE * rms.noise_floor:
            return (
                f"Model {model} reproduces test {test} to within the sensors' noise: error {before} RMS, noise {floor}."
            )
        return (
            f"Model {model} reproduces test {test}: its error is {before} RMS where the sensors' noise is {floor}, and "
            "nothing that is left points to a missing effect."
        )
    if found.verdict == "unexplained" or not found.steps:
        times = rms.before / rms.noise_floor if rms.noise_floor else 0.0
        return (
            f"Model {model} does not reproduce test {test}: its error is {before} RMS, {times:.2g} times the sensors' "
            f"noise, and no physical effect that was tried explains it."
        )
    lacks = ", then ".join(
        f"{step.effect.replace('_', ' ')} on {step.target} ({step.coefficient:.4g} ± {step.std:.2g} {step.unit})"
        for step in found.steps
    )
    rest = "" if found.complete else ", and what is left is more than noise"
    return (
        f"Model {model} lacks {lacks}: with it the error on test {test} falls from {before} to {after} RMS; the "
        f"sensors' noise is {floor}{rest}."
    )
