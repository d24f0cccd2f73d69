"""`fuzz`: spoilt inputs on every way in, judged, and docs/fuzz.md written."""

import argparse
import json
import multiprocessing as mp
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from time import monotonic

from crash_replay.fault import guarded
from crash_replay.said import say
from crash_replay.starting import begin, held

from ..core.structure import ModelError
from ..figures import write_markdown
from .page import page
from .targets import TARGETS
from .worker import MOST, WAITING, Result, input_of, restrict, tried

INPUTS = 20_000
STUCK = WAITING + 200.0
"""s after which a process that says nothing is taken to hang where no alarm reaches it."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__.partition(": ")[2])
    parser.add_argument("--inputs", type=int, default=INPUTS, metavar="N", help=f"default {INPUTS}")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="another one makes other inputs; default 1")
    parser.add_argument("--target", choices=TARGETS, help="only this one; the page is not written")
    parser.add_argument("--processes", type=int, default=os.cpu_count(), metavar="N")
    parser.add_argument("--to", type=Path, default=Path("docs/fuzz.md"), metavar="PAGE.md")
    parser.add_argument("--failures", type=Path, default=Path("out/fuzz"), metavar="DIR", help="inputs that fail")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="one of these once more, with its traceback")
    arguments = parser.parse_args()
    sys.exit(guarded(lambda: replay(arguments.replay) if arguments.replay else fuzz(arguments)))


def fuzz(arguments: argparse.Namespace) -> int:
    work = list(plan(arguments.inputs, arguments.seed, [arguments.target] if arguments.target else list(TARGETS)))
    start, results = monotonic(), []
    for result in judged(work, arguments.processes):
        results.append(result)
        if result.failed:
            file = save(result, arguments.failures)
            last = (result.detail.strip().splitlines() or [""])[-1][:200]
            say(f"{result.target}, seed {result.seed}: {result.outcome}: {last}; again: --replay {file}")
        if len(results) % 2000 == 0:
            say(f"{len(results)} of {len(work)} inputs, {monotonic() - start:.0f} s")
    failures = sum(result.failed for result in results)
    say(
        f"{len(results)} inputs, {failures} failures, {monotonic() - start:.0f} s; longest "
        f"{max(r.seconds for r in results):.2f} s, most memory {max(r.bytes for r in results) / 1e6:.0f} MB"
    )
    if not arguments.target:
        arguments.to.parent.mkdir(parents=True, exist_ok=True)
        write_markdown(arguments.to, [page(results, arguments.seed)])
    return 1 if failures else 0


def plan(inputs: int, seed: int, targets: list[str]) -> Iterator[tuple[str, str]]:
    """(target, seed) of each input, the targets mixed."""
    drawn = Random(seed).choices(targets, [TARGETS[name].share for name in targets], k=inputs)
    for number, target in enumerate(drawn):
        yield target, f"{seed}.{number}"


def judged(work: list[tuple[str, str]], processes: int) -> Iterator[Result]:
    """A result for each; a process that dies or hangs costs the input that it was at, and is replaced."""
    context = mp.get_context("spawn")  # with none of this process's memory
    crews = [Crew(context, work[k::processes]) for k in range(processes) if work[k::processes]]
    while crews:
        mp.connection.wait([crew.pipe for crew in crews], timeout=1.0)
        for crew in crews:
            yield from crew.results()
        crews = [crew for crew in crews if not crew.done]


class Crew:
    """A process and the inputs it has still to try."""

    def __init__(self, context, work: list[tuple[str, str]]):
        self.context, self.work, self.at = context, work, 0
        self._start()

    @property
    def done(self) -> bool:
        return self.at >= len(self.work)

    def results(self) -> Iterator[Result]:
        """Those that have come since the last look."""
        try:
            while not self.done and self.pipe.poll():
                result = self.pipe.recv()
                self.heard = monotonic()
                if result is None:  # it has loaded everything
                    continue
                self.at += 1
                yield result
                if result.bytes > MOST:  # all that follow would seem to take as much
                    self._replace()
        except EOFError:
            yield self._lost("the process died")
        if not self.done and monotonic() - self.heard > (STUCK if self.ready() else 300.0):
            yield self._lost("the process hung")
        if self.done:
            self.process.kill()
            self.process.join()

    def ready(self) -> bool:
        return self.heard > self.began

    def _lost(self, how: str) -> Result:
        target, seed = self.work[self.at]
        self.at += 1
        self._replace()
        return Result(target, seed, how, "", STUCK, 0)

    def _replace(self) -> None:
        self.process.kill()
        self.process.join()
        self._start()

    def _start(self) -> None:
        self.pipe, its = self.context.Pipe()
        self.began = self.heard = monotonic()
        self.process = self.context.Process(target=work_through, args=(its, self.work[self.at :]), daemon=True)
        with held():
            self.process.start()
        its.close()


def work_through(pipe, work: list[tuple[str, str]]) -> None:
    begin()
    restrict()
    pipe.send(None)
    for target, seed in work:
        pipe.send(tried(target, seed, input_of(target, seed)))


def save(result: Result, folder: Path) -> Path:
    """What makes the input once more, and the input itself for a test."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{result.target.replace(' ', '-')}-{result.seed}.json"
    files = {name: content.hex() for name, content in input_of(result.target, result.seed).items()}
    file.write_text(json.dumps({**result._asdict(), "files": files}, indent=1))
    return file


def replay(file: Path) -> int:
    try:
        saved = json.loads(file.read_text())
        files = {name: bytes.fromhex(content) for name, content in saved["files"].items()}
    except (ValueError, KeyError) as error:
        raise ModelError(f"{file}: not an input that `fuzz` has saved ({error})") from None
    restrict()
    result = tried(saved["target"], saved["seed"], files)
    say(f"{result.target}: {result.outcome}, {result.seconds:.2f} s, {result.bytes / 1e6:.0f} MB\n{result.detail}")
    return 1 if result.failed else 0


if __name__ == "__main__":
    main()
