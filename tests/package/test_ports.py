"""Python ports under the command's verbs."""

import math
import subprocess
import sys

import numpy as np
import pytest
from numpy_port import NumpyPort
from ports import Faulty, FieldsOnly, Listing, Mended, NotAPort, Signed

import decant

SMALL = "hostile-bowl"


def test_example_passes_every_check():
    report = decant.conform(SMALL, "hostile-periodic", backend=NumpyPort)
    report.require()
    assert report.passes and report.verdict == "pass" and not report.left_out
    assert {"density", "substep", "contact", "trajectory", "invariance", "status"} <= {row.check for row in report}
    frame = report.to_pandas()
    assert len(frame) == len(report) > 80
    assert (frame["score"] <= 1).all()
    assert set(frame["backend"]) == {"NumpyPort"}


@pytest.mark.parametrize(
    ("fault", "check", "reason"),
    [
        ("raise", "run", "ZeroDivisionError: no luck (ports.py:"),
        ("shape", "run", "ValueError: density has shape [379], not [380]"),
        ("flat", "run", "ValueError: acceleration has shape [1140], not [380, 3]"),
        ("kind", "run", "TypeError: fluid_neighbor_count has dtype float64, not integers"),
        ("text", "run", "TypeError: density"),
        ("unknown", "run", "ValueError: evaluate gives vorticity, which is no field"),
        ("abort", "run", "its process was ended by signal 6 (Aborted)"),
        ("segfault", "run", "its process was ended by signal 11 (Segmentation fault)"),
        ("leave", "run", "its process left with exit status 7"),
        ("hang", "run", "no answer within 3 s; ended"),
        ("reports", "substep", "particle 2, substep 1"),
        ("nan", "density", ""),
        ("unwritten", "pressure", ""),
        ("sign", "acceleration", "beyond tolerance"),
    ],
)
def test_fault_is_a_row_that_says_what_happened(fault, check, reason):
    options = {"fault": fault, "time_limit": 3}
    report = decant.conform(SMALL, backend=Faulty, options=options, checks=["fields", "substep"])
    assert not report.passes
    failing = [row for row in report.failures if row.check == check]
    assert any(reason in row.reason for row in failing), str(report)
    with pytest.raises(AssertionError, match=check):
        report.require()


def test_fault_is_found_where_it_is():
    report = decant.conform(SMALL, backend=Faulty, options={"fault": "sign"}, checks="fields")
    staged = [row.field for row in report.failures if row.check == "acceleration"]
    assert staged == ["pressure_acceleration"]
    row = report.failures[0]
    assert row.actual == pytest.approx(-row.expected, rel=1e-4)
    assert f"particle {row.worst_id}" in str(row) and "nearest" in str(row)


def test_what_is_not_offered_is_left_out():
    report = decant.conform("hostile-periodic-box", backend=FieldsOnly)
    assert report.passes
    assert {row.check for row in report if row.passes} == {"density", "pressure"}
    assert report.left_out and all("not offered" in row.reason for row in report.left_out)
    nothing = decant.conform(SMALL, backend=FieldsOnly)  # has walls
    assert not nothing.passes and not nothing.failures
    with pytest.raises(AssertionError, match="nothing was judged"):
        nothing.require()


def test_port_of_a_function_travels_pickled():
    factor = 1.5

    class Local(NumpyPort):
        def evaluate(self, given):
            fields = super().evaluate(given)
            return fields | {"density": fields["density"] * np.float32(factor)}

    report = decant.conform(SMALL, backend=Local, checks="fields")
    row = next(row for row in report.failures if row.check == "density")
    assert row.actual == pytest.approx(1.5 * row.expected, rel=1e-4)


def test_what_is_no_port_is_refused():
    with pytest.raises(TypeError, match="derived from decant.Port"):
        decant.conform(SMALL, backend=NotAPort)
    here = str(sys.modules["ports"].__file__)
    for backend, reason in [
        (f"python:{here}:NotAPort", "NotAPort is not derived from decant.Port"),
        (f"python:{here}:Nobody", "has no Nobody"),
        ("python:nowhere.py:Port", "nowhere.py: no such file"),
        ("python:no_such_module:Port", "No module named 'no_such_module'"),
        (f"python:{here}", "python:FILE:CLASS"),
        (f"python:{here}:Faulty:speed=3", "unexpected keyword argument 'speed'"),
    ]:
        with pytest.raises(decant.CommandError, match=reason) as raised:
            decant.conform(SMALL, backend=backend)
        assert raised.value.status == 2, raised.value


def test_fuzz_goes_on_and_saves_what_fails(tmp_path):
    good = decant.fuzz(backend=NumpyPort, cases=4)
    good.require()
    bad = decant.fuzz(backend=Faulty, options={"fault": "sign"}, cases=3, failures=tmp_path / "found")
    assert not bad.passes
    with pytest.raises(AssertionError):
        bad.require()
    found = list((tmp_path / "found").glob("*.h5"))
    assert found
    again = decant.conform(found[0], backend=Faulty, options={"fault": "sign"})
    assert not again.passes
    decant.conform(found[0], backend=NumpyPort).require()


def test_drift_sweeps_lists_that_a_port_gives(tmp_path):
    file = tmp_path / "drift.h5"
    result = decant.drift(SMALL, backend=Listing, intervals=[1, 5], skins=[0], window=10, report=file)
    frame = result.to_pandas()
    assert list(frame["interval"]) == [1, 5, 0]
    stale = frame[frame["interval"] == 5].iloc[0]
    assert stale["own_missed_share"] == pytest.approx(stale["missed_share"], rel=0.02)
    assert stale["missed_share"] > 0.001
    assert file.is_file() and "powers" in result.text
    without = decant.drift(SMALL, backend=NumpyPort, intervals=[5], skins=[0], window=4).to_pandas()
    own = without[without["interval"] == -1].iloc[0]
    assert math.isnan(own["missed_share"]) and own["density_rms"] < 1e-6


def test_bench_tells_stages():
    rows = decant.bench(SMALL, backend=Listing, more=["--substeps", "3", "--windows", "1"])
    assert "Listing" in str(rows)


def test_reports_compare(tmp_path):
    good, bad = tmp_path / "good.h5", tmp_path / "bad.h5"
    decant.conform(SMALL, backend=Mended, checks="fields", report=good)
    decant.conform(SMALL, backend=Signed, checks="fields", report=bad)
    assert decant.diff(good, good)[0]
    same, text = decant.diff(good, bad)
    assert not same and "pressure_acceleration" in text
    with pytest.raises(ValueError, match="decant_report is None; 3 is read"):
        decant.read_report(decant.fixture_folder() / "hostile-bowl.h5")


def test_scenes_of_validate_come_along():
    done = decant.command.run(["validate", "free-fall", "--quick", "--backend", "hash"], passes=(0, 1))
    assert done.returncode == 0 and "gates met" in done.stdout, done.stdout + done.stderr


def test_command_is_the_packages():
    command = [sys.executable, "-c", "from decant.command import main; main()"]
    done = subprocess.run([*command, "info"], capture_output=True, text=True)
    assert done.returncode == 0 and "backends" in done.stdout
    done = subprocess.run([*command, "conform", "no-such"], capture_output=True, text=True)
    assert done.returncode == 2


class Foreign:
    """An array that is NumPy's in nothing but DLPack."""

    def __init__(self, values):
        self.values = values

    def __dlpack__(self, **arguments):
        return self.values.__dlpack__(**arguments)

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


class OnDevice(Foreign):
    """One that has to be fetched."""

    def __dlpack__(self, **arguments):
        raise BufferError("not on the host")

    def __dlpack_device__(self):
        return (2, 0)

    def get(self):
        return self.values


@pytest.mark.parametrize("wrap", [Foreign, OnDevice, np.ndarray.tolist, lambda a: a])
def test_arrays_of_other_libraries(wrap):
    values = np.arange(6, dtype=np.float32).reshape(2, 3)
    np.testing.assert_array_equal(decant.on_host(wrap(values)), values)
    np.testing.assert_array_equal(decant.on_host(wrap(np.asfortranarray(values))), values)
