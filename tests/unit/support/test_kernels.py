from multiradar.restoration.bundle._window_kernels import drop_plot, move
from support.kernels import plain


def test_a_plain_form_calls_plain_forms() -> None:
    called = plain(drop_plot).__globals__["move"]
    assert called is plain(move)
    assert not hasattr(called, "py_func")
    # And these in turn, in other modules.
    assert not hasattr(called.__globals__["fly_with_slopes"], "py_func")
