"""The callback by which long tasks report their progress."""

from collections.abc import Callable

#: Function of the number of items that are done and the number of all items.
ReportProgress = Callable[[int, int], None]
