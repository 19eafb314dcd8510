"""Logs of a robot that pushed: what is read, and which rows are refused by name."""

import numpy as np
import pytest

from flatpush.documents import load_robot_log
from flatpush.errors import InputError

RAW = """\
100.00, 10.0, -300.0, 0.10, 12.0, -340.0, 1.57, 1
100.03, 10.0, -300.0, 0.10, 12.0, -339.5, 1.57, 1
100.07, 10.1, -299.6, 0.11, 12.0, -339.0, 1.57, 1
100.10, 10.2, -299.1, 0.12, 12.1, -338.5, 1.58, 2
"""
HEAD = (
    "object,start_id,run_id,t,obj_x_mm,obj_y_mm,obj_theta_rad,"
    "pusher_x_mm,pusher_y_mm,pusher_theta_rad,action_id,vision_lost"
)


def written(tmp_path, text, name="log.txt"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_raw_log_is_one_run_in_metres_from_time_zero(tmp_path):
    log = load_robot_log(written(tmp_path, RAW, "log2017.txt"))
    (run,) = log.runs
    assert (run.object, run.name, log.left_out, log.unended) == ("log2017", "log2017", (), None)
    np.testing.assert_allclose(run.times, [0, 0.03, 0.07, 0.1], atol=1e-9)
    np.testing.assert_allclose(run.poses[2], [0.0101, -0.2996, 0.11], atol=1e-12)
    np.testing.assert_allclose(run.hands[3], [0.0121, -0.3385, 1.58], atol=1e-12)
    assert run.actions.tolist() == [1, 1, 1, 2]
    assert run.seen.all()
    assert run.lines.tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize("change", [(", ", " "), (", ", "\t"), ("\n", ",\n"), ("\n", "\n\n# pause\n")])
def test_blanks_a_last_comma_and_comments_are_read_alike(tmp_path, change):
    run = load_robot_log(written(tmp_path, RAW.replace(*change))).runs[0]
    np.testing.assert_array_equal(run.hands, load_robot_log(written(tmp_path, RAW)).runs[0].hands)


def test_a_csv_tells_runs_apart_and_may_name_more_columns_in_any_order(tmp_path):
    names = HEAD.split(",")
    rows = [
        ["tri", "0", "0", "0.00", "1", "2", "0.1", "3", "4", "0.2", "1", "0"],
        ["tri", "0", "1", "0.00", "1", "2", "0.1", "3", "4", "0.2", "1", "0"],
        ["tri", "0", "0", "0.03", "0", "0", "0", "3", "5", "0.2", "1", "1"],
    ]
    for turn in (1, -1):
        text = "\n".join(",".join(["x", *row][::turn]) for row in [names, *rows]) + "\n"
        log = load_robot_log(written(tmp_path, text, "log.csv"))
        assert [run.name for run in log.runs] == ["tri 0 0", "tri 0 1"]
        assert [len(run.times) for run in log.runs] == [2, 1]
        assert log.runs[0].seen.tolist() == [True, False]
        assert log.runs[0].lines.tolist() == [2, 4]


def test_an_object_at_exactly_zero_was_not_seen(tmp_path):
    lost = RAW + "100.13, 0, 0, 0, 12.1, -338.0, 1.58, 2\n"
    assert load_robot_log(written(tmp_path, lost)).runs[0].seen.tolist() == [True] * 4 + [False]


BAD = {
    "cut off": ("100.13, 10.3, -298.", "it has 3 of 8 columns"),
    "too wide": ("100.13, 1, 1, 1, 1, 1, 1, 2, 9, 9", "it has 10 of 8 columns"),
    "back in time": ("100.05, 1, 1, 1, 1, 1, 1, 2", "its stamp 100.05 runs back behind that of line 4"),
    "repeated": ("100.10, 1, 1, 1, 1, 1, 1, 2", "its stamp 100.10 repeats that of line 4"),
    "NaN": ("100.13, 1, nan, 1, 1, 1, 1, 2", r"obj_y_mm is not finite \(nan\)"),
    "infinite": ("100.13, 1, 1, 1, inf, 1, 1, 2", r"pusher_x_mm is not finite \(inf\)"),
    "no number": ("100.13, 1, 1, x, 1, 1, 1, 2", r"obj_theta_rad is not a number \('x'\)"),
    "no push": ("100.13, 1, 1, 1, 1, 1, 1, 2.5", r"action_id is not the number of a push \(2.5\)"),
}


@pytest.mark.parametrize(("row", "reason"), BAD.values(), ids=BAD)
def test_a_bad_row_is_refused_with_its_line_or_left_out_and_listed(tmp_path, row, reason):
    path = written(tmp_path, RAW + row + "\n100.20, 10.2, -299.1, 0.12, 12.1, -338.5, 1.58, 2\n")
    with pytest.raises(InputError, match=f"1 row cannot be used: line 5: {reason}") as refused:
        load_robot_log(path)
    assert "log.txt" in str(refused.value)
    log = load_robot_log(path, skip_bad=True)
    assert [bad.line for bad in log.left_out] == [5]
    assert log.runs[0].lines.tolist() == [1, 2, 3, 4, 6]
    assert np.isfinite(log.runs[0].poses).all()


def test_many_bad_rows_are_counted_and_the_first_named(tmp_path):
    with pytest.raises(InputError, match=r"9 rows cannot be used: line 5: .*; and 4 more"):
        load_robot_log(written(tmp_path, RAW + "100.2, 1\n" * 9))


def test_a_last_line_without_its_end_is_told(tmp_path):
    assert load_robot_log(written(tmp_path, RAW.rstrip("\n"))).unended == 4


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("# nothing\n\n", "the file is empty"),
        (HEAD + "\n", "no usable row"),
        (HEAD.replace("pusher_x_mm,", "") + "\n", "names no column pusher_x_mm"),
        (HEAD + ",t\n", "two columns have the name 't'"),
        (HEAD + "\n1,1,1,0,1,1,1,1,1,1,1,yes\n", r"line 2: vision_lost is neither 0 nor 1 \('yes'\)"),
        (HEAD + '\n1,1,"1,0,1\n', "line 2 is not CSV"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path, text, said):
    with pytest.raises(InputError, match=said):
        load_robot_log(written(tmp_path, text))


def test_the_recorded_logs_are_whole(data_folder):
    files = sorted((data_folder / "robot_exp_logs").glob("log_*.csv"))
    assert files
    for path in files:
        log = load_robot_log(path)
        assert not log.left_out
        assert log.unended is None
        for run in log.runs:
            assert np.all(np.diff(run.times) > 0)
            assert run.seen[-1]
