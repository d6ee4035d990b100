"""Faults: how they read, in which order they come, and what the user probably meant."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from quadvis.errors import (
    DiagramError,
    Fault,
    Faults,
    Place,
    QuadvisError,
    RunError,
    closest,
    quoted,
    sentence,
    suggestion,
)

HERE = Place("hover.yaml", 10, 11)

# What hands do to the names that diagrams hold: slips of one or two keys, swaps, plurals, other cases.
TYPOS = """
derivatve:derivative derivitive:derivative dervative:derivative derivaitve:derivative Derivative:derivative
nested_saturaton:nested_saturation nested-saturation:nested_saturation nestedsaturation:nested_saturation
saturtaion:saturation satruation:saturation saturation_nested:saturation dk:kd ik:ki pk:kp kpp:kp raet:rate
rte:rate rates:rate reate:rate arte:rate bolck:block blok:block bloks:blocks blcok:block prot:port
ports:port tsak:task postion:position posiiton:position poistion:position positon:position velocty:velocity
veloctiy:velocity acros:across accross:across acorss:across smaple:sample sampel:sample hodl:hold hlod:hold
dealy:delay max_ag:max_age maxage:max_age max-age:max_age on_stal:on_stale onstale:on_stale
bandwith:bandwidth bandwidht:bandwidth banwidth:bandwidth gian:gain giain:gain camrea:camera camara:camera
cmaera:camera plnat:plant plan:plant estimater:estimator esitmator:estimator treshold:threshold
threshhold:threshold thresold:threshold freqency:frequency frequencey:frequency
"""


def nearest_by_hand(word: str, other: str) -> float:
    """Return the optimal string alignment distance by its definition, swaps at 0.7."""
    table = {}
    for i in range(len(word) + 1):
        for j in range(len(other) + 1):
            if not i or not j:
                table[i, j] = float(i + j)
                continue
            same = word[i - 1] == other[j - 1]
            choices = [table[i - 1, j] + 1, table[i, j - 1] + 1, table[i - 1, j - 1] + (not same)]
            if i > 1 and j > 1 and word[i - 2 : i] == other[j - 2 : j][::-1]:
                choices.append(table[i - 2, j - 2] + 0.7)
            table[i, j] = min(choices)
    return table[len(word), len(other)]


def test_a_fault_reads_place_subject_problem_remedy():
    fault = Fault(HERE, "block 'pd'", "no input 'zz'", "did you mean 'z'?")
    assert str(fault) == "hover.yaml:10:11: block 'pd': no input 'zz'; did you mean 'z'?"
    assert str(Fault(HERE, "", "it is empty")) == "hover.yaml:10:11: it is empty"
    assert str(Place("hover.yaml")) == "hover.yaml"


def test_a_diagram_error_lists_faults_by_place_once_each():
    late, early = Fault(Place("a.yaml", 10, 1), "", "late"), Fault(Place("a.yaml", 9, 30), "", "early")
    error = DiagramError([late, early, late])
    assert error.faults == [early, late]
    assert str(error).splitlines() == ["a.yaml:9:30: early", "a.yaml:10:1: late"]
    assert isinstance(error, QuadvisError) and error.exit_code == 2


def test_a_run_error_names_block_port_and_time():
    error = RunError("the value is NaN", block="loop/pd", port="u", time=1.25)
    assert str(error) == "block 'loop/pd', port 'u', t = 1.25 s: the value is NaN"
    assert (error.block, error.port, error.time, error.exit_code) == ("loop/pd", "u", 1.25, 1)
    assert str(RunError("the disk is full")) == "the disk is full"


def test_faults_carry_the_subject_that_is_being_checked():
    faults = Faults()
    with faults.about("block 'pd'"):
        faults.add(HERE, "inner")
        with faults.about("block 'pd', input 'u'"):
            faults.add(HERE, "innermost")
        faults.add(HERE, "given", subject="rate 'fast'")
    faults.add(HERE, "outer")
    assert [fault.subject for fault in faults] == ["block 'pd'", "block 'pd', input 'u'", "rate 'fast'", ""]


def test_collect_returns_the_result_or_keeps_the_faults():
    faults = Faults()

    def fail(problem: str) -> int:
        raise DiagramError([Fault(HERE, "", problem)])

    with faults.about("block 'pd'"):
        assert faults.collect(int, "12") == 12
        assert faults.collect(fail, "bad") is None
        assert faults.collect(fail, problem="worse") is None
    assert faults == [Fault(HERE, "block 'pd'", "bad"), Fault(HERE, "block 'pd'", "worse")]


def test_collect_lets_other_errors_pass():
    with pytest.raises(ZeroDivisionError):
        Faults().collect(lambda: 1 / 0)


def test_check_raises_only_if_there_is_a_fault():
    faults = Faults()
    faults.check()
    faults.add(HERE, "bad")
    with pytest.raises(DiagramError, match=r"10:11: bad$"):
        faults.check()


def test_a_file_that_is_wrong_everywhere_ends_the_check():
    faults = Faults()
    with pytest.raises(DiagramError) as caught:
        for line in range(10 * Faults.LIMIT):
            faults.add(Place("a.yaml", line + 1, 1), "bad")
    assert len(caught.value.faults) == Faults.LIMIT


def test_nine_of_ten_typing_slips_find_their_word_first():
    pairs = [pair.split(":") for pair in TYPOS.split()]
    words = sorted({right for _, right in pairs})
    assert len(pairs) >= 60
    wrong = [(typo, closest(typo, words)) for typo, right in pairs if closest(typo, words) != right]
    assert len(wrong) <= len(pairs) // 10, wrong


@pytest.mark.parametrize(
    ("word", "candidates", "meant"),
    [
        ("dk", ["kp", "ki", "kd"], "kd"),
        ("zz", ["y", "z"], "z"),
        ("derivatve", ["signal.delay", "signal.derivative"], "signal.derivative"),
        ("estimation.delay", ["signal.delay", "signal.derivative"], "signal.delay"),
        ("control.delay", ["control.relay", "signal.delay"], "control.relay"),
        ("pos", ["posture_x", "position"], "posture_x"),
        ("MAX-AGE", ["max_age"], "max_age"),
        ("rate", ["rat", "rate"], "rate"),
        ("x", ["y", "z"], None),
        ("", ["a"], None),
        ("abcdef", ["uvwxyz", "qqq"], None),
        ("a" * 1000, ["a" * 999], None),
    ],
)
def test_the_word_that_was_meant(word, candidates, meant):
    assert closest(word, candidates) == meant


@given(st.text("abcd", min_size=4, max_size=9), st.data())
def test_a_single_slip_in_a_word_finds_it_again(word, data):
    at = data.draw(st.integers(0, len(word) - 2))
    slips = [word[:at] + word[at + 1 :], word[:at] + "x" + word[at:], word[:at] + "x" + word[at + 1 :]]
    slips.append(word[:at] + word[at + 1] + word[at] + word[at + 2 :])
    for slip in slips:
        assert closest(slip, ["mnopqr", word]) == word


@given(st.text("abc", min_size=4, max_size=7), st.lists(st.text("abc", min_size=4, max_size=7), max_size=6))
def test_no_candidate_is_nearer_than_the_chosen_one(word, candidates):
    prefixed = [other for other in candidates if word.startswith(other) or other.startswith(word)]
    assume(not prefixed)
    chosen = closest(word, candidates)
    distances = [nearest_by_hand(word, other) for other in candidates]
    if chosen is not None:
        assert nearest_by_hand(word, chosen) == pytest.approx(min(distances))
    else:
        assert all(distance > 1 for distance in distances)


@given(st.text(), st.lists(st.text(), max_size=5))
def test_any_texts_get_a_candidate_or_none(word, candidates):
    assert closest(word, candidates) in [*candidates, None]
    assert "\n" not in suggestion(word, candidates)


def test_a_suggestion_names_the_near_word_or_lists_a_few():
    assert suggestion("raet", ["rate", "block"]) == "did you mean 'rate'?"
    assert suggestion("x", ["rate", "block"]) == "choose from 'rate', 'block'"
    assert suggestion("x", ["rate"]) == "use 'rate'"
    assert suggestion("x", []) == ""
    assert suggestion("x", [f"word{i}" for i in range(50)]) == ""


def test_sentences_join_only_what_there_is():
    assert sentence("it is wrong", "write 1") == "it is wrong; write 1"
    assert sentence("it is wrong") == "it is wrong"


@given(st.text(), st.integers(10, 60))
def test_quoted_text_stays_on_one_printable_line(text, limit):
    shown = quoted(text, limit)
    assert shown.isprintable() and shown[0] in "'\""
    if text.isalnum() and text.isprintable() and len(text) <= limit:
        assert shown == f"'{text}'"


def test_places_order_by_file_line_column():
    places = [Place("a", 1, 2), Place("a", 2, 1), Place("a", 10, 1), Place("b", 1, 1)]
    assert all(first < second for first, second in pairwise(places))
