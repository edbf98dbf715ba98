# SPDX-License-Identifier: GPL-3.0-or-later
"""The quick cases of stress.py, which defines what is checked in each case."""

import pytest
import stress

pytestmark = pytest.mark.needs_library


@pytest.mark.parametrize("case", [case for case in stress.cases() if case.is_quick],
                         ids=lambda case: case.name)
def test_case(case):
    assert stress.measure(case).failures == []
