"""The pytest plug-in, in runs of their own."""

from pathlib import Path

HERE = Path(__file__).parent

SUITE = """
import sys
sys.path[:0] = [{tests!r}, {examples!r}]
import pytest
from ports import Faulty, FieldsOnly
from numpy_port import NumpyPort

@pytest.mark.decant({marker})
def test_conforms(decant_verdict):
    decant_verdict.require()
"""


def suite(marker):
    return SUITE.format(tests=str(HERE), examples=str(HERE.parents[1] / "tools/package/examples"), marker=marker)


def run(pytester, marker, *arguments):
    pytester.makepyfile(suite(marker))
    return pytester.runpytest_subprocess("-v", *arguments)


def test_one_test_per_recording_and_check(pytester):
    result = run(pytester, "backend=NumpyPort, recordings=['hostile-bowl', 'hostile-empty'], checks=['fields', 'mass']")
    result.assert_outcomes(passed=4)
    result.stdout.fnmatch_lines(["*test_conforms?hostile-bowl-fields? PASSED*", "*hostile-empty-mass? PASSED*"])


def test_failure_reads_without_a_traceback(pytester):
    result = run(pytester, "backend=Faulty, options={'fault': 'sign'}, recordings=['hostile-bowl'], checks=['fields']")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["Faulty on hostile-bowl: acceleration / pressure_acceleration: fail*"])
    result.stdout.fnmatch_lines(["*actual*expected*"])
    result.stdout.no_fnmatch_line("*Traceback*")


def test_what_is_not_offered_is_skipped(pytester):
    result = run(pytester, "backend=FieldsOnly, recordings=['hostile-periodic-box'], checks=['fields', 'mass']")
    result.assert_outcomes(passed=1, skipped=1)


def test_crash_fails_every_check(pytester):
    result = run(pytester, "backend=Faulty, options={'fault': 'abort'}, recordings=['hostile-bowl'], checks=['mass']")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*ended by signal 6*"])


def test_backend_from_the_command_line_and_the_ini_file(pytester):
    marker = "recordings=['hostile-bowl'], checks=['fields']"
    run(pytester, marker, "--decant-backend", "hash").assert_outcomes(passed=1)
    pytester.makeini("[pytest]\ndecant_backend = list\n")
    run(pytester, marker).assert_outcomes(passed=1)


def test_without_a_backend_it_says_how_to_name_one(pytester):
    result = run(pytester, "recordings=['hostile-bowl'], checks=['fields']")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*no backend in the marker, --decant-backend*"])


def test_unknown_check_is_refused(pytester):
    result = run(pytester, "backend='hash', checks=['vibes']")
    assert result.ret != 0
    result.stdout.fnmatch_lines(["*checks vibes; known are fields,*"])
