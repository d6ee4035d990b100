"""What ``import quadvis`` gives."""

import pytest

import quadvis


@pytest.mark.parametrize("name", quadvis.__all__)
def test_each_public_name_is_there(name: str) -> None:
    assert getattr(quadvis, name) is not None


def test_a_fault_of_a_diagram_is_caught_by_the_public_name() -> None:
    with pytest.raises(quadvis.QuadvisError, match=r"nowhere\.yaml"):
        quadvis.load("nowhere.yaml")
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        quadvis.nothing  # noqa: B018
