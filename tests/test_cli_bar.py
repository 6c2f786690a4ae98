"""How far work is, where no terminal shows a bar."""

from kinverse.cli import _bar


def test_without_a_terminal_lines_tell_how_far_it_is(monkeypatch, capsys):
    now = iter([0.0, 1.0, 11.0, 11.0, 12.0])
    monkeypatch.setattr(_bar.time, "monotonic", lambda: next(now))
    with _bar.Bar("all") as bar:
        bar("soon", 0.1)
        bar("[cell]", 0.5)
        bar("at once", 0.6)
    told = capsys.readouterr().err.split("\n")
    assert told == ["kinverse: note:  50% [cell]", ""]
