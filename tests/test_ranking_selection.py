"""Conditions and limits against row-by-row evaluation in Python, and the message of every error."""

import math
import operator
import re

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import explore
from explore.base.units.shown import Scale, read_shown_units
from explore.results.ranking.conditions import parse_condition
from explore.results.ranking.limits import parse_limits, resolve_limits

COLUMNS = {
    "a": np.array([0.0, 1.0, 2.0, np.nan, -1.5, np.inf]),
    "b": np.array([1, 1, 0, 2, -3, 4]),
    "andy": np.array([0.0, np.nan, 2.0, np.nan, 1.0, -np.inf]),
}
SIGNS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne}
operands = st.one_of(
    st.sampled_from(sorted(COLUMNS)), st.sampled_from(["0", "1", "-1.5", "+2", ".5", "2.", "1e1", "-3E-1"])
)
comparisons = st.lists(st.tuples(st.sampled_from(sorted(SIGNS)), operands), min_size=1, max_size=3).flatmap(
    lambda rest: operands.map(lambda first: ("compare", first, rest))
)
trees = st.recursive(
    comparisons,
    lambda inner: st.one_of(
        st.tuples(st.just("not"), inner),
        st.tuples(st.sampled_from(["and", "or"]), st.lists(inner, min_size=2, max_size=3)),
    ),
    max_leaves=8,
)


def written(tree):
    """The tree as text, with all its brackets."""
    if tree[0] == "compare":
        return tree[1] + "".join(f" {sign}{operand}" for sign, operand in tree[2])
    if tree[0] == "not":
        return f"not ({written(tree[1])})"
    return f" {tree[0]} ".join(f"({written(part)})" for part in tree[1])


def holds(tree, row):
    """Whether one row meets the tree, in Python's own arithmetic."""
    if tree[0] == "not":
        return not holds(tree[1], row)
    if tree[0] != "compare":
        return (all if tree[0] == "and" else any)([holds(part, row) for part in tree[1]])
    values = [row[text] if text in row else float(text) for text in (tree[1], *(operand for _, operand in tree[2]))]
    pairs = zip([sign for sign, _ in tree[2]], values, values[1:], strict=False)
    return all(SIGNS[sign](x, y) and not math.isnan(x) and not math.isnan(y) for sign, x, y in pairs)


@settings(derandomize=True, deadline=None, max_examples=400)
@given(trees)
def test_a_condition_means_what_it_says_in_every_row(tree):
    condition = parse_condition(written(tree), sorted(COLUMNS))
    rows = [{name: values[k] for name, values in COLUMNS.items()} for k in range(6)]
    assert condition.test(COLUMNS).tolist() == [holds(tree, row) for row in rows]


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("a > 0 or b > 0 and a < 0", "a > 0 or (b > 0 and a < 0)"),
        ("not a > 0 and b > 0", "(not (a > 0)) and b > 0"),
        ("not not a > 0", "a > 0"),
        ("0 < a <= 2", "0 < a and a <= 2"),
        ("a<-1", "a < -1"),
        ("\ta<1\nor(b>1)", "a < 1 or b > 1"),
    ],
)
def test_words_bind_as_in_python(text, meaning):
    names = sorted(COLUMNS)
    np.testing.assert_array_equal(
        parse_condition(text, names).test(COLUMNS), parse_condition(meaning, names).test(COLUMNS)
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "at the end: expected a comparison"),
        ("a", "at the end: expected a comparison here: <"),
        ("and", "at character 1: expected a comparison"),
        ("b > 1 and adny < 3", "at character 11: no column 'adny'; did you mean 'andy'?"),
        ("a = 3", "at character 3: '=' is not supported; write =="),
        ("a < 1 & b < 2", "at character 7: '&' is not supported; write and"),
        ("a < 20deg", "at character 5: 'deg' cannot be converted to '1'; use a plain number"),
        ("a < 1e999", "at character 5: the number is too large"),
        ("(a < 1", "at the end: a closing bracket is missing"),
        ("a < 1)", "at character 6: this closing bracket has no opening one"),
        ("a < 1 b < 2", "at character 7: expected 'and' or 'or' here"),
        ("1 mm < 2", "at character 1: 'mm' cannot be converted to '1'"),
        ("a < 1 AND b < 2", "at character 7: write and in lower case"),
        ("NOT a < 1", "at character 1: write not in lower case"),
        ("a < 0,5", "at character 6: ',' is not supported; write 0.5, not 0,5"),
        ("a < not b", "at character 5: expected a comparison"),
        ("a.b < 1", "at character 2: unexpected '.'"),
        ("a + b < 1", "at character 3: unexpected '+'"),
        ("__import__('os').system('ls')", "unexpected "),
        ("(" * 100_000 + "a < 1" + ")" * 100_000, "at character 52: brackets are nested more than 50 deep"),
        ("a < 1or b < 2", "at character 5: '1or' is not a number"),
        ("a < 1 # and b < 2", "at character 7: unexpected '#'"),
        ("a < 1\\\nor b < 2", "at character 6: unexpected"),
        ("a is b", "at character 3: expected a comparison"),
        ("\u017f < 1", "at character 1: no column"),  # Python itself reads this letter as s
        ("a < \u0663", "is not a number"),
    ],
)
def test_what_cannot_be_read_is_pointed_at(text, message):
    with pytest.raises(explore.RequestError) as caught:
        parse_condition(text, sorted(COLUMNS))
    assert str(caught.value).startswith("where: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    ["not " * 10_000 + "a < 1", "a < 1" + " or a < 1" * 10_000, "a < 1" + " <= 1" * 10_000],
    ids=["not", "or", "chain"],
)
def test_a_long_condition_needs_no_deep_stack(text):
    assert parse_condition(text, ["a"]).test({"a": np.array([0.5, 3.0])}).tolist() == [True, False]


LENGTHS = {"crank": np.array([76.2, 101.6, 101.7, np.nan]), "reach": np.array([0.09, 0.1, 0.11, 0.0])}
DECLARED = {"crank": Scale("mm", "mm"), "reach": Scale("m", "m")}
INCHES = read_shown_units({"length": "in"}).scales({"crank": "mm", "reach": "m"})


@pytest.mark.parametrize(
    ("text", "scales", "meets"),
    [
        ("crank <= 4 in", DECLARED, [True, True, False]),
        ("crank<=4in and crank != 10.16cm", DECLARED, [True, False, False]),
        ("3.5 in < crank <= 101.6", DECLARED, [False, True, False]),
        ("crank <= 4", INCHES, [True, True, False]),
        ("4 >= crank > 80 mm", INCHES, [False, True, False]),
        ("not crank <= 101.6 mm", INCHES, [False, False, True]),
        ("reach < crank", DECLARED, [True, True, True]),  # numbers of different units, as they are stored
        ("reach < crank", INCHES, [False, True, False]),  # 3.54, 3.94 and 4.33 in against 3, 4 and 4.004 in
    ],
)
def test_numbers_are_in_the_shown_unit_or_have_their_own(text, scales, meets):
    """4 in is exactly 101.6 mm, so that a comparison with it must not be decided by a rounding error."""
    test = parse_condition(text, list(LENGTHS), scales).test
    assert test(LENGTHS)[:3].tolist() == meets
    assert bool(test(LENGTHS)[3]) is text.startswith("not"), "a comparison with NaN is false"


def test_units_that_do_not_fit_are_pointed_at():
    for text, message in {
        "crank < 4 inn": "where: at character 9: unknown unit 'inn'; did you mean 'in'?",
        "crank > 1 or 4 rpm < crank": "where: at character 14: 'rpm' cannot be converted to 'mm'; use mm, cm, m or in",
    }.items():
        with pytest.raises(explore.RequestError, match=f"^{re.escape(message)}$"):
            parse_condition(text, list(LENGTHS), DECLARED)


def test_a_table_with_units_is_limited_and_selected_with_units():
    table = pd.DataFrame({"cv": [3.0, 2.0, 1.0], "crank": LENGTHS["crank"][:3]})
    table.attrs["units"] = {"crank": "mm", "cv": "1"}
    assert explore.rank(table, objectives=["cv"], where="crank <= 4 in").index.tolist() == [1]
    assert explore.rank(table, objectives=["cv"], limits={"crank": {"max": "4 in"}}).index.tolist() == [1]
    with pytest.raises(explore.RequestError, match="limit on crank: 'rpm' cannot be converted to 'mm'"):
        explore.rank(table, objectives=["cv"], limits={"crank": {"max": "4 rpm"}})


def test_a_limit_is_named_in_the_shown_unit():
    (limit,) = resolve_limits({"crank": {"max": "4"}}, {"crank": {"min": None, "max": 127.0}}, ["crank"], INCHES)
    assert (limit.value, str(limit)) == (101.6, "crank <= 4 in")
    with pytest.raises(explore.RequestError, match="6 in is above the max of 5 in of the sweep"):
        resolve_limits({"crank": "6"}, {"crank": {"min": None, "max": 127.0}}, ["crank"], INCHES)


def test_a_column_may_have_the_name_of_a_keyword_of_python():
    table = pd.DataFrame({"cv": [1.0, 2.0], "lambda": [0.5, 0.1]})
    assert explore.rank(table, objectives=["cv:min"], where="lambda < 0.2").index.tolist() == [1]


@settings(derandomize=True, deadline=None, max_examples=500)
@given(st.text(alphabet="ab andornt()<>=!.0123456789e+-_&|~'\"[]\n\0é", max_size=40))
def test_any_text_is_read_or_refused_in_one_line(text):
    try:
        mask = parse_condition(text, sorted(COLUMNS)).test(COLUMNS)
    except explore.RequestError as error:
        outcome = str(error)
    else:
        outcome = f"{mask.shape}"
    assert outcome == "(6,)" or outcome.startswith("where: at ")
    assert outcome.isprintable()


TABLE = pd.DataFrame(
    {
        "cv": [1.0, 2.0, 3.0, 4.0],
        "gain": [1.0, 2.0, 3.0, np.nan],
        "feasible": [True, True, False, True],
        "word": list("abcd"),
    }
)
TABLE.attrs["constraints"] = {"gain": {"min": 0.5, "max": None}, "both": {"min": 0.0, "max": 1.0}}


def test_conditions_and_limits_choose_among_the_feasible_rows_of_a_table():
    objectives = ["cv", "gain:max"]
    assert explore.rank(TABLE, objectives=objectives).index.tolist() == [0, 1]
    assert explore.rank(TABLE, objectives=objectives, where="cv != 2").index.tolist() == [0]
    assert explore.rank(TABLE, objectives=["cv"], where="cv > 2").index.tolist() == [3]
    assert explore.rank(TABLE, objectives=["cv"], where="not gain <= 2").index.tolist() == [3]
    assert explore.rank(TABLE, objectives=["cv"], limits={"gain": 1.5}).index.tolist() == [1]
    assert explore.rank(TABLE, objectives=["cv:max"], limits={"cv": {"max": 1.5}}).index.tolist() == [0]
    assert explore.rank(TABLE, objectives=objectives, where="cv > 9").empty


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"gani": 1.0}, "no metric 'gani'; did you mean 'gain'?"),
        ({"word": 1.0}, "no metric 'word'"),
        ({"cv": 1.0}, "it has no constraint, so say which side: min (cv>=VALUE) or max (cv<=VALUE)"),
        ({"both": 0.5}, "it is constrained on both sides, so say which side: min (both>=VALUE) or max (both<=VALUE)"),
        ({"both": {"max": 0.5}}, "its values are not in these results; sweep with both among the metrics of the study"),
        (
            {"gain": 0.25},
            "0.25 is below the min of 0.5 of the sweep; designs beyond that were screened",
        ),
        ({"both": {"max": 2}}, "2 is above the max of 1"),
        ({"gain": {"mni": 1}}, "give {'min': …}, {'max': …} or both"),
        ({"gain": {}}, "give {'min': …}"),
        ({"gain": math.nan}, "nan is not a finite number"),
        ({"gain": 10**400}, "is not a finite number"),
        ({"gain": "1 mm"}, "limit on gain: 'mm' cannot be converted to '1'"),
        ({"gain": "one"}, "limit on gain: 'one' is not a number with a unit"),
        ({"gain": True}, "true is not a finite number"),
        ({"gain": None}, "None is not a finite number"),
    ],
)
def test_wrong_limits_get_one_line(limits, message):
    with pytest.raises(explore.RequestError) as caught:
        explore.rank(TABLE, objectives=["cv"], limits=limits)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_limits_are_read_from_texts():
    texts = ["cv<=0.4", " time_ratio >= 1.1 ", "time_ratio<=1.2", "swing_angle=-4e1"]
    assert parse_limits(texts) == {
        "cv": {"max": "0.4"}, "time_ratio": {"min": "1.1", "max": "1.2"}, "swing_angle": "-4e1",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["cv"], "write METRIC=VALUE, METRIC>=VALUE or METRIC<=VALUE"),
        (["cv<0.4"], "write METRIC=VALUE"),
        (["<=3"], "write METRIC=VALUE"),
        (["cv<=1", "cv<=2"], "'cv' is limited twice"),
        (["cv=1", "cv<=2"], "'cv' is limited twice"),
        (["cv<=2", "cv=1"], "'cv' is limited twice"),
    ],
)
def test_wrong_texts_of_limits_get_one_line(texts, message):
    with pytest.raises(explore.RequestError) as caught:
        parse_limits(texts)
    assert message in str(caught.value)


@pytest.mark.parametrize(("side", "bound", "value"), [("min", 30.0, 35.0), ("max", 150.0, 140.0)])
def test_a_metric_of_which_only_the_margin_was_kept_is_limited_by_it(side, bound, value):
    metric = np.array([29.0, 31.0, 34.0, 36.0, 139.0, 141.0, 151.0, np.nan])
    columns = {"angle_margin": metric - bound if side == "min" else bound - metric}
    (limit,) = resolve_limits({"angle": value}, {"angle": {"min": None, "max": None, side: bound}}, ["cv"])

    np.testing.assert_array_equal(limit.is_met(columns), metric >= value if side == "min" else metric <= value)


@pytest.mark.parametrize("side", ["min", "max"])
def test_a_limit_may_be_the_bound_itself_and_is_met_by_a_design_on_it(side):
    bounds = {"angle": {"min": None, "max": None, side: 30.0}}
    (limit,) = resolve_limits({"angle": 30.0}, bounds, ["angle"])
    (by_margin,) = resolve_limits({"angle": 30.0}, bounds, ["cv"])

    assert limit.is_met({"angle": np.array([30.0])}).tolist() == [True]
    assert by_margin.is_met({"angle_margin": np.array([0.0])}).tolist() == [True]
