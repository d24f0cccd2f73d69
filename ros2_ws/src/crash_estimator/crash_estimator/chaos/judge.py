"""What a disturbed run must end in: complete and identical, or incomplete, said and with a status that is not 0.

Pure: what a run has left, and what the undisturbed one has, decide.
"""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

COMPLETE, SAID, FAILED = "complete", "said", "FAILED"

TELLING = re.compile(r"incomplete|\berror:|too early|not ready|was killed|cannot|without|interrupted")
"""In a line that may say that something is incomplete; it must also name whose product it is, or be of him."""
FAULTY = re.compile(
    r"Traceback \(most recent|Error occurred at:|Fatal Python error|terminate called|Segmentation fault|Aborted"
)
"""In no output at all."""

Content = Mapping[str, str]
"""What a product says, piece by piece: of each sample a digest, of each final answer its text."""


class Ended(NamedTuple):
    """How a member has ended."""

    name: str
    status: int | None  # None: it had not, and was killed by the judge
    said: str
    killed: bool = False  # by a fault, and not started again
    had_all: bool = False  # every sample, by its own word before it was killed


class Product(NamedTuple):
    owner: str  # name of the member whose it is
    content: Content
    says: bool = False  # in itself, that it is incomplete


class Outcome(NamedTuple):
    ended: Sequence[Ended]
    products: Mapping[str, Product]
    sent: bool = True  # at least one sample
    endless: str = ""  # what was waited for when the limit was reached
    broken: str = ""  # a file that cannot be read


class Verdict(NamedTuple):
    verdict: str
    why: str


def judged(outcome: Outcome, reference: Mapping[str, Content]) -> Verdict:
    """reference: the contents of the undisturbed run's products."""
    if fault := _fault_of_a_program(outcome):
        return Verdict(FAILED, fault)
    lacks = {name: _lacks(product.content, reference[name]) for name, product in outcome.products.items()}
    lacks = {name: lack for name, lack in lacks.items() if lack}
    status = [e for e in outcome.ended if e.status and not e.killed]
    if silent := [e.name for e in status if not TELLING.search(e.said)]:
        return Verdict(FAILED, f"{', '.join(silent)} ended with a status that is not 0 and has not said why")
    not_said = [f"{name} {lack}" for name, lack in lacks.items() if not _is_said(outcome, outcome.products[name].owner)]
    if not_said:
        return Verdict(FAILED, f"nobody says it: {'; '.join(not_said)}")
    if lacks:
        return Verdict(SAID, "; ".join(f"{name} {lack}" for name, lack in lacks.items()))
    if status:
        return Verdict(SAID, f"all is there, and {', '.join(f'{e.name} ended with {e.status}' for e in status)}")
    return Verdict(COMPLETE, "")


def _fault_of_a_program(outcome: Outcome) -> str:
    if outcome.endless:
        return f"endless wait: {outcome.endless}"
    if outcome.broken:
        return outcome.broken
    for ended in outcome.ended:
        if ended.status is None:
            return f"{ended.name} did not end when it was told to"
        if ended.status < 0 and not ended.killed:
            return f"{ended.name} was ended by signal {-ended.status}, which nobody sent"
        if found := FAULTY.search(ended.said):
            return f"{ended.name}: {found[0]}"
    return ""


def _lacks(content: Content, reference: Content) -> str:
    """What is not as in the undisturbed run; "" where all is."""
    missing = sum(piece not in content for piece in reference)
    other = sum(content[piece] != text for piece, text in reference.items() if piece in content)
    more = len(content.keys() - reference.keys())
    counts = {"missing": missing, "other than undisturbed": other, "too many": more}
    said = ", ".join(f"{count} of {len(reference)} {what}" for what, count in counts.items() if count)
    return said


def _is_said(outcome: Outcome, owner: str) -> bool:
    """Whether a member with a status that is not 0 says that the product of `owner` is incomplete."""
    for ended in outcome.ended:
        if ended.name == owner and ended.status and any(p.owner == owner and p.says for p in outcome.products.values()):
            return True  # its terminal may be closed
        if ended.name == owner and ended.killed and (ended.had_all or not outcome.sent):
            return True  # nobody else can know: its own terminal shows how it ended
        if not ended.status or ended.killed:
            continue
        lines = [line for line in ended.said.splitlines() if TELLING.search(line)]
        if lines and (ended.name == owner or any(owner in line for line in lines) or not outcome.sent):
            return True
    # nothing has begun: there is no test that somebody could lack something of
    return not outcome.sent and any(ended.killed for ended in outcome.ended)
