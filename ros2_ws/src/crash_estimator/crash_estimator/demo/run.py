"""One demonstration from its first sample to its last line."""

import sys
import time
from collections.abc import Hashable, Sequence
from pathlib import Path

from ..core.errors import equation_errors
from ..tables import error_table, parameter_table
from ..viewer.native import has_display
from .children import Children
from .choice import Choice
from .listening import Listening
from .picture import Picture
from .story import Story
from .terminal import Terminal, near

# How long is waited though nothing gets further, in s; who is stopped or silent is given up by `company`.
STARTING = 600.0
"""For all to be ready: what is not compiled yet takes minutes on a slow machine with other work."""
STANDING_STILL = 400.0
"""For the next sample or estimate; longer than a replay waits for listeners of which we know nothing."""
ANSWERING = 1800.0
"""For the diagnosis, which works and says so, to judge all samples, and again with what it has added."""
TAKING_IN = 150.0
"""For the diagnosis to take in its next sample after the replay's end: who has been stopped goes on within that, and
what has not reached it nobody sends again."""
LATE = 10.0
"""For an answer that the diagnosis says it has given."""
ESTIMATING = 120.0
"""For the estimators to estimate all samples again with what was added."""
DRAWING = 600.0
"""For the viewer to draw what waits."""
DRAWING_THE_REST = 30.0
"""Where something is missing already."""
CLOSING = 90.0
"""For the viewer to finish its file."""

MISSING = ("Missing effect", "which effect the model lacks, and its error, fit by fit; shaded where the model fails")
LOOK_AT = (
    ("Overview", "measured and predicted acceleration, force over crush; with what was added, and faded as given"),
    ("Residuals", "what each model leaves; beyond the grey band it is more than the sensors' noise: the model fails"),
    ("Force over crush", "the loop of each element: its slope is the stiffness, what it encloses the absorbed energy"),
    ("Parameters", "stiffness with its sigma; in the lanes below, when each element loads, unloads or is apart"),
    ("Motion and states", "bodies and springs move with the time cursor: drag it through the crash"),
)


class Run:
    """Watches the processes and tells the terminal."""

    def __init__(self, children: Children, choices: Sequence[Choice], terminal: Terminal, rrd: Path | None):
        self.children, self.terminal, self.rrd = children.all, terminal, rrd
        self.choices = {choice.name: choice for choice in choices}
        self.story = Story() if "diagnosis" in self.children else None

    def to_the_end(self) -> int:
        """Exit status 0, or 1 where something is missing: the last line then says what."""
        with Listening(self.children, list(self.choices), self.terminal, self.story) as self.listening:
            self.watch, self.company = self.listening.watch, self.listening.company
            self.incomplete, self._wait = self.listening.incomplete, self.listening.wait
            if self._start():
                self._follow()
                if self.story:
                    self._wait_for_answer()
                else:
                    self._tables()
                self._wait_for_viewer()
        return self._conclude()

    def _start(self) -> bool:
        """Wait until the replay has begun: it does when all have said that they are ready."""
        company, watch = self.company, self.watch

        def waits_for() -> dict[str, str]:
            found = {name: company.how(name) for name in self.children if name != "replay"}
            return {name: how for name, how in found.items() if how != "ready"}

        def tell(waited: float) -> None:
            named = ", ".join(f"{name} ({how})" for name, how in waits_for().items())
            hint = "; after an update they compile their code first" if waited > 5.0 and named else ""
            self.terminal.wait(f"waiting for {named or 'the first sample'}{hint}", waited)

        over = lambda: not watch.waiting or bool(company.lost) or not company.there("replay")  # noqa: E731
        in_time = self._wait(over, tell, STARTING, lambda: tuple(waits_for().items()))
        if in_time and watch.waiting and not company.lost:
            self.incomplete.append(f"replay has ended before its first sample: {self.children['replay'].last_words()}")
        if not in_time:
            late = waits_for() or {"replay": company.how("replay")}
            who = ", ".join(f"{name} ({how})" for name, how in late.items())
            logs = next(iter(self.children.values())).log.parent
            self.incomplete.append(f"not ready after {STARTING:g} s: {who}; what they say is in {near(logs)}")
        return not watch.waiting and not self.incomplete

    def _follow(self) -> None:
        """Until the replay has ended, and all that the estimators have to say has come."""
        watch, company, encoding = self.watch, self.company, self.terminal.stream.encoding

        def over() -> bool:
            told = all(watch.settled(name) or not company.there(name) for name in self.choices)
            return not company.there("replay") and (told or not watch.finished)

        def progress() -> Hashable:
            has = tuple(watch.has(name) for name in self.choices)
            return watch.run, watch.state.number, has, watch.lost(), time.monotonic() if watch.paused else 0.0

        if not self._wait(over, lambda _: self.terminal.progress(watch.progress(encoding)), STANDING_STILL, progress):
            behind = [name for name in self.choices if not watch.settled(name)]
            who = ", ".join(["replay"] * company.there("replay") + behind)
            self.incomplete.append(f"nothing has come for {STANDING_STILL:g} s of {who}: start again")
        self.terminal.end_progress(watch.progress(encoding))
        for name in self.choices:
            if lacks := watch.lacks(name):
                self.incomplete.append(f"{name} has {lacks}")

    def _wait_for_answer(self) -> None:
        """Until the diagnosis has said its last word: on all samples, and on the model with what it has added."""
        story, company, watch = self.story, self.company, self.watch

        def done() -> bool:
            word = company.word("diagnosis")
            return word is not None and word.done and (word.run == watch.run or bool(word.reason))

        def tell(waited: float) -> None:
            doing = "judging the model with it" if story.finals else "comparing every candidate on all samples"
            self.terminal.wait(doing, waited)

        def progress() -> Hashable:
            return len(story.finals)

        def taken_in() -> int:
            word = company.word("diagnosis")
            return word.next if word else 0

        gone = lambda: not (company.there("diagnosis") and watch.finished)  # noqa: E731
        has_all = lambda: done() or gone() or taken_in() >= watch.total  # noqa: E731
        if not self._wait(has_all, tell, TAKING_IN, taken_in):
            why = f"it has {taken_in()} of {watch.total} samples, and the replay has ended"
            return self.incomplete.append(f"no answer of the diagnosis ({why})")
        in_time = self._wait(lambda: done() or gone(), tell, ANSWERING, progress)
        if done():
            self._wait(lambda: story.complete or gone(), tell, LATE, progress)
        if story.complete:
            return self._wait_for_addition() if story.added else None
        word = company.word("diagnosis")
        if not in_time:
            why = f"at work for {ANSWERING:g} s without one; start again when the machine has less to do"
        elif not watch.finished:
            why = "the replay did not get to its last sample"
        else:
            why = company.lost.get("diagnosis") or (word and word.reason) or "it has not come"
        self.incomplete.append(f"no answer of the diagnosis ({why})")

    def _wait_for_addition(self) -> None:
        """Until the estimators of the model have estimated all samples again with what was added."""
        model = next(iter(self.choices.values())).model
        same = [name for name, choice in self.choices.items() if choice.model == model]

        def left() -> tuple[str, ...]:
            return tuple(name for name in same if not self.listening.revisions[name] and self.company.there(name))

        waiting = self.terminal.waiting_for("estimating all samples again")
        if not self._wait(lambda: not left(), waiting, ESTIMATING, left):
            self.incomplete.append(f"what was found was not added to {', '.join(left())}")

    def _tables(self) -> None:
        replay = self.children["replay"]
        if replay.status == 0:
            self.terminal.say(f"replay {replay.last_line()}")
        for name, choice in self.choices.items():
            has = self.watch.has(name)
            lost = self.watch.total - has
            self.terminal.say(f"\n{name}: model {choice.model}, method {choice.method}, {has} samples, {lost} lost\n")
            found = self.watch.said[name].found()
            errors = equation_errors(*found) if found else []
            if any(error.samples for error in errors):
                self.terminal.say(f"{parameter_table(*found)}\n\n{error_table(errors)}")
            else:
                self.terminal.say("nothing of the impact was estimated")

    def _wait_for_viewer(self) -> None:
        """Until it has drawn all and finished its file; it would wait for more then."""
        company = self.company
        if "viewer" not in self.children:
            return
        self.terminal.say()
        viewer = self.children["viewer"]

        def drawn() -> bool:
            word = company.word("viewer")
            return not company.there("viewer") or (word is not None and word.done)

        waiting = self.terminal.waiting_for(f"writing {near(self.rrd)}")
        # Where something is missing it may wait for that in vain; told to end, it draws what it has.
        patience = DRAWING if not self.incomplete else DRAWING_THE_REST if self.watch.finished else 0.0
        if not self._wait(drawn, waiting, patience, lambda: None) and not self.incomplete:
            self.incomplete.append(f"the viewer has not drawn all within {DRAWING:g} s")
        company.let_go.add("viewer")
        if viewer.status is None and "viewer" not in company.lost:
            viewer.process.terminate()
            self._wait(lambda: viewer.status is not None, waiting, CLOSING, lambda: None)
        if viewer.status is None:
            self.incomplete.append(f"no whole {near(self.rrd)} (the viewer has not finished it)")
        elif viewer.status and "viewer" not in company.lost:
            self.incomplete.append(f"no whole {near(self.rrd)} ({viewer.last_words()})")
        elif viewer.status == 0:
            self._say_where_to_look()

    def _say_where_to_look(self) -> None:
        self.terminal.say(f"viewer {self.children['viewer'].last_line()}")
        if not has_display():
            self._draw_picture()
        rerun = Path(sys.prefix) / "bin" / "rerun"
        window = "The viewer stays open; look at it again later" if has_display() else "Look at it"
        self.terminal.say(f"\n{window} with: {near(rerun)} {near(self.rrd)}\n\nWhat to look at, by tab:")
        for tab, what in ([MISSING] if self.story else []) + list(LOOK_AT):
            self.terminal.say(f"  {tab:18} {what}")

    def _draw_picture(self) -> None:
        picture = Picture(self.rrd, self.terminal.waiting_for("drawing its picture"))
        why = picture.draw()
        self.terminal.clear()
        if why:
            self.incomplete.append(f"no picture: {why}")
        else:
            self.terminal.say(f"its picture: {near(picture.png.absolute())}")

    def _conclude(self) -> int:
        replay = self.children["replay"]
        if replay.status and not self.incomplete:  # it knows of somebody whom we do not
            self.incomplete.append(f"replay: {replay.last_words()}")
        if self.incomplete:
            self.terminal.say(f"incomplete: {'; '.join(self.incomplete)}")
        return 1 if self.incomplete else 0
