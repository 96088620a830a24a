"""Lines of progress where there is no terminal."""

from itertools import count

from explore.cli import progress


def test_lines_say_the_rate_and_the_time_left(monkeypatch, capsys):
    """One in five seconds of a clock that takes three from call to call; the first call begins it."""
    clock = count(100.0, 3.0)
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    with progress.block_bar("ranking", lines=True) as tell:
        for done in (0, 60, 120, 180):
            tell(done, 240)
    assert capsys.readouterr().err.splitlines() == [
        "ranking: 60 of 240, 10/s, 18 s left",
        "ranking: 180 of 240, 15/s, 4 s left",
    ]
