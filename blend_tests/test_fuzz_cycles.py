# SPDX-License-Identifier: GPL-3.0-or-later
"""Two random scenes of fuzz_cycles.py, which defines what is checked: ground, and a window."""

import fuzz_cycles
import pytest

pytestmark = pytest.mark.needs_library


@pytest.mark.parametrize("seed", [2, 6])
def test_scene(seed):
    outcome = fuzz_cycles.measure(seed)
    print(fuzz_cycles.line(outcome))  # `pytest -s` shows this
    assert outcome.failures == []
