"""The oracle and scenes in this process."""

import json

import numpy as np
import pytest

import decant


def test_oracle_gives_what_is_recorded():
    fixture = decant.read_fixture("hostile-bowl")
    oracle = decant.Oracle(fixture.scene, fixture.state)
    fields = oracle.evaluate()
    assert set(fields) == {*decant.REAL_FIELDS, *decant.COUNT_FIELDS}
    for name, values in fields.items():
        np.testing.assert_array_equal(values, fixture.fields[name], err_msg=name)


def test_tolerance_has_the_shape_of_the_fields():
    fixture = decant.read_fixture("hostile-bowl")
    oracle = decant.Oracle(fixture.scene, fixture.state)
    fields, tolerance = oracle.evaluate(), oracle.tolerance()
    for name in decant.REAL_FIELDS:
        assert tolerance[name].shape == fields[name].shape
        assert (tolerance[name] >= 0).all()
    relative = tolerance["density"] / fields["density"]
    assert 1e-7 < np.median(relative) < 1e-4


def test_oracle_goes_on_in_substeps_and_takes_other_states():
    fixture = decant.read_fixture("hostile-bowl")
    one, two = (decant.Oracle(fixture.scene, fixture.state) for _ in range(2))
    one.advance(3)
    for _ in range(3):
        two.advance()
    assert one.read().substep == fixture.state.substep + 3
    np.testing.assert_array_equal(one.read().position, two.read().position)
    assert not np.array_equal(one.read().position, fixture.state.position)
    one.load(fixture.state)
    np.testing.assert_array_equal(one.read().position, fixture.state.position)
    with pytest.raises(ValueError):
        one.advance(-1)
    with pytest.raises(ValueError):
        one.load(decant.State(fixture.state.position[1:], fixture.state.velocity))


def test_given_density_is_what_accelerations_follow_from():
    fixture = decant.read_fixture("hostile-bowl")
    oracle = decant.Oracle(fixture.scene, fixture.state)
    before = oracle.evaluate()
    given = oracle.evaluate(decant.Given(density=before["density"] * 1.01))
    assert not np.array_equal(given["acceleration"], before["acceleration"])
    np.testing.assert_array_equal(oracle.evaluate()["acceleration"], before["acceleration"])
    with pytest.raises(ValueError, match="pressure comes with density"):
        oracle.evaluate(decant.Given(pressure=before["pressure"]))
    with pytest.raises(RuntimeError, match="density has 379 values, not 380"):
        oracle.evaluate(decant.Given(density=before["density"][1:]))


def test_scene_of_a_file():
    scene = decant.Scene.load(str(decant.scene_folder() / "pour-4k.json"))
    assert scene.support_radius == pytest.approx(2 * scene.particle_spacing)
    assert scene.containers == 2
    assert scene.kernel == "cubic_spline"
    assert scene.periodic == (False, False, False)
    assert json.loads(scene.to_json())["particle_spacing"] == scene.particle_spacing
    state, walls = scene.initial_state(), scene.walls()
    assert len(state) > 3000 and state.position.shape == state.velocity.shape == (len(state), 3)
    assert walls.position.shape == (len(walls), 3) and set(walls.container) == {0, 1}
    np.testing.assert_array_equal(state.position, state.position.astype(np.float32))


def test_scene_tells_what_is_wrong_with_it():
    with pytest.raises(decant.InputError, match="mine.json.*support_ratio"):
        text = (decant.scene_folder() / "pour-4k.json").read_text()
        decant.Scene.parse('{"support_ratio": -1,' + text[text.index("{") + 1 :], "mine.json")
    with pytest.raises(decant.InputError, match="nowhere.json"):
        decant.Scene.load("nowhere.json")
    assert issubclass(decant.InputError, ValueError)


def test_pose_and_distance():
    scene = decant.Scene.load(str(decant.scene_folder() / "pour-4k.json"))
    late = scene.pose(0, 1.5)
    np.testing.assert_allclose(late.rotation @ late.rotation.T, np.eye(3), atol=1e-14)
    assert not np.allclose(late.rotation, scene.pose(0, 0.0).rotation)
    points = np.array([[0.1, 0.2, 0.3], [-1.0, 0.5, 0.0]])
    np.testing.assert_allclose(late.to_local(late.to_world(points)), points, atol=1e-14)
    # Velocities are the derivative of where a point of the container is.
    step = 1e-6
    moved = scene.pose(0, 1.5 + step).to_world(points) - scene.pose(0, 1.5 - step).to_world(points)
    np.testing.assert_allclose(late.velocity_at(late.to_world(points)), moved / (2 * step), atol=1e-5)
    wall = scene.walls()
    inside = wall.position[wall.container == 0]
    distance, normal = scene.distance(0, inside)
    assert (distance < 0).all()
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-12)
    out = inside - (distance - 1e-4)[:, None] * normal
    # But for where edges are near.
    outside = scene.distance(0, out)[0]
    assert (outside > 0).all() and np.isclose(outside, 1e-4, atol=1e-9).mean() > 0.95
    with pytest.raises(IndexError):
        scene.pose(2, 0.0)
    with pytest.raises(IndexError):
        scene.distance(-1, points)


def test_recordings_come_along():
    names = decant.recordings()
    assert len(names) > 25 and "hostile-bowl" in names
    assert not any("56k" in name for name in names)
    with pytest.raises(FileNotFoundError, match="no recording of that name"):
        decant.read_fixture("hostile-nothing")
    assert (decant.include_folder() / "decant/plugin.h").is_file()
