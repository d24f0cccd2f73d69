"""The date of a test, as laboratories write it -> the stamp of its impact."""

from datetime import UTC, datetime

from ..limits import STAMP, UNDATED
from ..recording import RecordingError
from ..time_unit import SECOND

FORMS = ("%Y-%m-%d", "%d.%m.%Y", "%d/%b/%Y", "%Y/%m/%d")
"""ISO 8601, as in ISO-MME; German; NHTSA's 03/OCT/2017."""
TIMES = ("", " %H:%M:%S", "T%H:%M:%S", " %H:%M", "T%H:%M")


def stamp_of(date: str) -> int:
    """ns since 1970 of a date, or date and time, taken as UTC; midnight without a time; 0 for what is no date."""
    for form in (day + time for day in FORMS for time in TIMES):
        try:
            second = int(datetime.strptime(date.strip(), form).replace(tzinfo=UTC).timestamp())
        except ValueError:
            continue
        return second * SECOND if second > UNDATED.highest and not STAMP.wrong(second) else 0
    return 0


def checked_stamp(date: str, where: str) -> int:
    """The same of a date that a user gives, "" for none."""
    if date and not stamp_of(date):
        raise RecordingError(f"{where}: expected a date such as 2019-05-04 or 2019-05-04 14:30, got {date!r}")
    return stamp_of(date) if date else 0
