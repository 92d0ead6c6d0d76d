"""The example in Warp, on the CPU here."""

import numpy as np
import warp as wp
from warp_port import WarpPort

import decant


def test_example_passes_every_check():
    decant.conform("hostile-bowl", "hostile-periodic", "hostile-empty", "motion-drum", backend=WarpPort).require()


def test_half_precision_is_judged_and_fails():
    class Half(WarpPort):
        def evaluate(self, given):
            fields = super().evaluate(given)
            return fields | {"density": wp.array(fields["density"].astype(np.float16), dtype=wp.float16)}

    report = decant.conform("hostile-bowl", backend=Half, checks="fields")
    assert {row.check for row in report.failures} == {"density"}


def test_arrays_of_warp():
    values = np.arange(12, dtype=np.float32).reshape(4, 3)
    np.testing.assert_array_equal(decant.on_host(wp.array(values, dtype=wp.vec3, device="cpu")), values)
    np.testing.assert_array_equal(decant.on_host(wp.array(values[:, 0], dtype=float, device="cpu")), values[:, 0])
