from quadvis.testing import drive
from quadvis_blocks.supervision.transfer_jump import TransferJump


def test_a_control_jumps_by_its_change_at_the_tick_at_which_it_changes_hands() -> None:
    controls = [[4.0, 0.0, 0.0, 0.0], [5.0, 1.0, 2.0, 3.0], [6.0, 0.5, 2.0, 3.0]]
    found = drive(TransferJump(), controls=controls, source=[[1, 1, 1, 1], [1, 0, 1, 1], [1, 1, 0, 1]])
    assert found.jump.tolist() == [[0.0] * 4, [0.0, 1.0, 0.0, 0.0], [0.0, -0.5, 0.0, 0.0]]
    assert found.changes.tolist() == [0, 1, 3]


def test_the_first_source_is_no_change() -> None:
    found = drive(TransferJump(), controls=[9.0] * 4, source=[1, 2, 3, 0], steps=2)
    assert (found.jump == 0.0).all() and (found.changes == 0).all()
