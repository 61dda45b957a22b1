"""The results that come with the package, and how they get there."""

import pytest

from data_tools import store_reproduction
from mocaplab.reproduction.stored import STORED, read_table, stored_table
from mocaplab.reproduction.verdicts import FAILS, HOLDS, NOT_ASKED, OPEN, WEAKER


def test_the_stored_run_says_what_it_was_made_with():
    label, rows = stored_table("claims")
    assert label.startswith("budget ")
    assert {row["verdict"] for row in rows} <= {HOLDS, WEAKER, FAILS, OPEN, NOT_ASKED}
    assert {row["verdict"] for row in rows} & {HOLDS, WEAKER, FAILS}
    for name in STORED:
        table = stored_table(name)
        assert table is None or (table.label == label and table.rows)
    assert stored_table("figure_05").rows[0]["clip"]


def test_tables_are_read_with_their_label():
    assert read_table("# budget 5\na,b\n1,x\n") == ("budget 5", [{"a": "1", "b": "x"}])
    with pytest.raises(ValueError, match="expected a CSV file of mocaplab reproduce, got 'a,b'"):
        read_table("a,b\n1,2\n")


def test_a_run_is_stored(tmp_path, capsys, monkeypatch):
    run, target = tmp_path / "run", tmp_path / "data"
    run.mkdir(), target.mkdir()
    monkeypatch.setattr(store_reproduction, "TARGET", target)
    assert store_reproduction.main([str(run)]) == 2
    assert "has no claims.csv" in capsys.readouterr().err
    (run / "claims.csv").write_text("# budget 5\nclaim\nx\n")
    (run / "figure_05.csv").write_text("# budget 5\nclip\nwalk\n")
    (run / "figure_04.csv").write_text("# budget 5\nclip\nlong\n")
    (target / "figure_08.csv").write_text("of an older run")
    assert store_reproduction.main([str(run)]) == 0
    assert {path.name for path in target.iterdir()} == {"claims.csv", "figure_05.csv"}
    assert stored_table("figure_05", target).rows == [{"clip": "walk"}]
    assert stored_table("figure_08", target) is None
    (run / "figure_05.csv").write_text("# budget 5\nclip\n" + "walk\n" * 30_000)
    assert store_reproduction.main([str(run)]) == 2
    assert "at most 100000 bytes" in capsys.readouterr().err
