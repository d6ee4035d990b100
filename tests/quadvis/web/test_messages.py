"""What a page may send: any text is a request, or a sentence on why it is none."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import QuadvisError
from quadvis.web.forwarding import FORWARDED, OWN, SCOPE, check_verb, permitted
from quadvis.web.messages import MOST_NAMES, PageRequest, read, read_names, read_request

PLAIN = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=8,
)
KEYS = st.sampled_from(["id", "verb", "args", "beat", "token", "x"])
MESSAGES = st.one_of(
    st.text(max_size=60),
    st.binary(max_size=20),
    PLAIN.map(json.dumps),
    st.dictionaries(KEYS, PLAIN).map(json.dumps),
)


@given(MESSAGES)
def test_a_message_is_a_request_or_a_sentence(message: str | bytes) -> None:
    try:
        request = read_request(read(message))
    except QuadvisError as error:
        assert str(error)
        return
    assert isinstance(request, PageRequest) and 0 <= request.id < 2**53
    assert isinstance(request.verb, str) and isinstance(request.arguments, dict)


@given(st.dictionaries(st.sampled_from(["names", "topics"]), st.one_of(PLAIN, st.lists(st.text(max_size=5)))))
def test_names_are_a_list_of_texts_or_a_sentence(arguments: dict[str, Any]) -> None:
    try:
        found = read_names(arguments, "names")
    except QuadvisError as error:
        assert "'names'" in str(error)
        return
    assert found == arguments["names"] and all(isinstance(name, str) for name in found)
    assert len(found) <= MOST_NAMES


@given(st.one_of(st.text(max_size=12), st.sampled_from([*FORWARDED, *OWN])), st.integers(0, 4))
def test_a_verb_is_permitted_or_refused_in_a_sentence(verb: str, level: int) -> None:
    try:
        check_verb(verb, level)
        allowed = True
    except QuadvisError:
        allowed = False
    assert allowed == (verb in permitted(level))


@given(st.text(max_size=12))
def test_a_page_listens_to_scopes_alone(topic: str) -> None:
    if SCOPE.fullmatch(topic):
        head, _, number = topic.partition("/")
        assert head == "scope" and 1 <= int(number) <= 9999
