"""The words of docs/missing-effects.md."""

from .effects_plan import SEEDS

HEAD = """\
# Which missing effect is found, and how surely

Simulated tests with a physical effect hidden in them, given to `diagnose` with a model that lacks it. Made by
`make benchmark-effects`, which can be stopped and goes on where it was; one case by its name with
`make benchmark-effects ARGS="--case NAME"`. *Right* means: the verdict is `effect_missing`, and the effect that was
hidden leads the ranking, on the target it was hidden on. Shares have Wilson's 95 % interval; a/b means a of b. Two
recordings are at 0.75 and 1.1 of the nominal speed, one is at 1.1; sampling is 10 kHz and noise white in all
accelerometers, where the tables do not say otherwise."""

HOW = """\
By [`crash_replay.synthetic.hidden`](../ros2_ws/src/crash_replay/crash_replay/synthetic/hidden), which shares nothing
with the search: its own force laws, its own 4th-order Runge-Kutta at 25 us, its own sensors (white noise, zero offset,
steps of 0.03 g; the barrier's load cells 3 kN and 0.1 kN). For every seed the structure is drawn anew: masses within
-20 to +25 %, stiffnesses by a quarter, characteristics that are straight or curved, smooth or with an abrupt change,
elastic or unloading along a known slope, clearances and driven motions.

An effect of size 1 makes 12 to 35 % of its target's peak force; a channel's gain is off by 3 to 9 %, its offset by 1.6
to 4.6 g, its delay 0.3 to 0.8 ms; a load cell's offset is 2 to 7 % of the largest force, a stated speed off by 2 to
6 %. At size 1/2 it is half of that. Outside the vocabulary are `rotation` (a body that turns, its accelerometer off its
centre), `timed_force` (a push that depends on time alone) and `changing_mass` (a mass that grows during the crash).

What no method could tell from what is recorded is not asked. This is decided by the simulated physics alone, before any
search, and the structure is then drawn anew
([`observable.py`](../ros2_ws/src/crash_replay/crash_replay/synthetic/hidden/observable.py)):

- an element hardly loaded (under 15 % of the largest peak force, or under 10 mm of crush);
- `cubic_stiffness`, `bottoming_out`, `yielding` and `clearance` where the model leaves the element's curve free: such a
  curve contains them; and `yielding` of an element that unloads along a line, beside which it would pull;
- `plastic_unloading` where the element has not come down to half of its peak force;
- the mass of the car and the gain of the barrier in `single`: M a = -F with both measured, F(X) free; in `impactor`,
  whose crush is measured, whatever only scales, shifts or delays its one equation;
- `load_path` where all bodies are joined already;
- `guide_friction` of a body that does not come back: until then it is a constant force;
- an effect with which its element hardly carries any more, such as a gap that hardly closes: no stiffness does as well;
- an effect that, at its nominal size and beside the other one hidden, moves all that is recorded by less than 20
  standard deviations of 1 g of noise (root of the sum of squares over both recordings); of a driven channel's error,
  what it makes of the channels of the bodies that it drives counts, not the channel itself, which no model predicts,
  and 15 of these must be left when the laws that the model leaves free have taken in what they can;
- outside the vocabulary, what is less than 60 of these from the nearest effect inside, the mean of what changes: a
  mass that has grown before its body is pushed is an added mass.

Two names of one law: an element of one constant stiffness with a gap is, as long as it is not pulled, that element with
no stiffness and a stop of its stiffness where the gap closes. `bottoming_out` on an element that has a hidden
`clearance` therefore counts as right where its stop is within 5 % of the gap. A `load_path` from a to b is one from b
to a.

Seeds of these cases start at {seeds}; nothing was developed on them.""".format(seeds=f"{SEEDS:,}".replace(",", " "))

NOT_RIGHT = """\
Every one at nominal size, 0.5 to 2 g and 10 kHz, of one recording (`/1.1/` in its name) or two; the name makes it
again."""
