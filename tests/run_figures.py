"""Figures that tests report, wherever they ran: they travel with the report of the test, also from another process."""


def user_property_values(terminalreporter, key):
    """The values that tests appended to their ``user_properties`` under this key, in the order of the reports."""
    for reports in terminalreporter.stats.values():
        for report in reports:
            if getattr(report, "when", None) == "teardown":  # the last of a test, which has them all
                yield from (value for name, value in report.user_properties if name == key)
