from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundles import IMAGE, JOINTS, ROBOT, manifest, space, write, write_choosing, write_seeing, write_summing

from frobs_deploy import Image, Policy
from frobs_deploy.errors import BundleError, BundleMismatchError, PolicyArgumentError
from frobs_deploy.spaces import space_from_json


def observation(*numbers: float) -> Any:
    return np.array(numbers, np.float32)


def test_it_acts_for_one_observation_and_for_many(arm: Path) -> None:
    policy = Policy(arm)
    one = policy.act(observation(0.25, -0.5, 9.0))
    np.testing.assert_array_equal(one, observation(0.25, -0.5))
    assert one.dtype == np.float32
    policy.reset()
    many = policy.act(np.stack([observation(0.25, -0.5, 9.0)] * 3))
    np.testing.assert_array_equal(many, np.stack([one] * 3))


def test_actions_are_clipped_to_their_space(arm: Path) -> None:
    np.testing.assert_array_equal(Policy(arm).act(observation(5.0, -7.0, 0.0)), observation(1.0, -1.0))


@pytest.mark.parametrize("bounds", [{"low": math.nan}, {"high": math.nan}, {"low": [0.0, 2.0]}])
def test_a_bundle_with_bounds_that_cannot_hold_is_refused(bounds: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="a bound of the space Box"):
        space_from_json(space(2, **bounds))


def test_named_terms_make_up_a_flat_observation(arm: Path) -> None:
    policy = Policy(arm)
    terms = {"height": np.array([9.0]), "joint_positions": np.array([0.25, -0.5])}
    np.testing.assert_array_equal(policy.act(terms), observation(0.25, -0.5))
    policy.reset()
    batch = {name: np.stack([value] * 2) for name, value in terms.items()}
    assert policy.act(batch).shape == (2, 2)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (observation(1, 2), r"has shape \(2,\), not \(3,\)"),
        (np.zeros((1, 1, 3), np.float32), r"shape \(1, 3\)"),
        (np.zeros(3), r"the type float64, not float32; convert it with astype\(np\.float32\)"),
        (np.zeros(3, np.int32), "the type int32"),
        (observation(1, math.nan, 2), r"is not finite at \[1\]: nan"),
        (observation(1, 0, math.inf), r"is not finite at \[2\]: inf"),
        (np.zeros((0, 3), np.float32), "empty batch"),
        ({"joint_positions": observation(1, 2)}, r"lacks 'height'; expected 'joint_positions', 'height'"),
        (
            {"joint_positions": observation(1, 2), "heigth": observation(1)},
            "lacks 'height' and contains the unknown 'heigth'",
        ),
        (
            {"joint_positions": observation(1), "height": observation(1)},
            r"observation\['joint_positions'\] has shape \(1,\)",
        ),
    ],
)
def test_an_observation_that_does_not_match_is_refused(given: Any, message: str, arm: Path) -> None:
    with pytest.raises(BundleMismatchError, match=message):
        Policy(arm).act(given)


def test_a_refused_observation_leaves_the_policy_as_it_was(tmp_path: Path) -> None:
    policy = Policy(write_summing(tmp_path / "sum.frobs"))
    policy.act(observation(1.0))
    with pytest.raises(BundleMismatchError):
        policy.act(observation(math.nan))
    assert policy.act(observation(1.0)) == 2.0


def test_a_dictionary_is_taken_by_its_keys(tmp_path: Path) -> None:
    policy = Policy(write_choosing(tmp_path / "choice.frobs"))
    a, b = observation(0, 1, 0), observation(0.5, 0, 2)
    action = policy.act({"b": b, "a": a})
    assert action == 2
    assert action.dtype == np.int64
    np.testing.assert_array_equal(policy.scores, a + b)
    policy.reset()
    assert policy.act({"a": a[None], "b": b[None]}).tolist() == [2]
    for given, message in [
        ({"a": a}, "lacks 'b'"),
        (a, "is a single array; expected a mapping that contains 'a', 'b'"),
        ({"a": a, "b": b[None]}, "different sizes"),
        ({"a": a, "b": b[:2]}, r"observation\['b'\] has shape"),
    ]:
        with pytest.raises(BundleMismatchError, match=message):
            policy.act(given)


def test_a_recurrent_policy_remembers_until_it_is_reset(tmp_path: Path) -> None:
    policy = Policy(write_summing(tmp_path / "sum.frobs"))
    assert policy.recurrent
    assert [policy.act(observation(x)).item() for x in (1, 2, 3)] == [1, 3, 6]
    policy.reset()
    batch = np.array([[1], [10]], np.float32)
    assert policy.act(batch).ravel().tolist() == [1, 10]
    policy.reset(np.array([True, False]))
    assert policy.act(batch).ravel().tolist() == [1, 20]
    assert policy.act(batch).ravel().tolist() == [2, 30]
    with pytest.raises(BundleMismatchError, match=r"the batch size changed from 2 to 3; call reset\(\)"):
        policy.act(np.zeros((3, 1), np.float32))
    with pytest.raises(PolicyArgumentError, match="mask must be a bool array"):
        policy.reset(np.array([True]))


def test_the_robot_must_be_that_of_the_training(arm: Path) -> None:
    assert Policy(arm, robot=ROBOT, joint_names=JOINTS, control_timestep=0.04)
    with pytest.raises(
        BundleMismatchError, match="the robot differs from the robot used in training: its fingerprint is cdcd"
    ):
        Policy(arm, robot="cd" * 32)
    with pytest.raises(BundleMismatchError, match="trained with shoulder, elbow; use this order"):
        Policy(arm, joint_names=JOINTS[::-1])
    with pytest.raises(
        BundleMismatchError, match=r"the joints are wrist, but the policy was trained with shoulder, elbow\."
    ):
        Policy(arm, joint_names=["wrist"])


def test_the_rate_must_be_that_of_the_training(arm: Path, tmp_path: Path) -> None:
    wrong: tuple[Any, ...] = (0.02, 0.0401, math.nan, "0.02")
    for timestep in wrong:
        with pytest.raises(BundleMismatchError, match=r"the policy was trained with 0\.04 s \(25 Hz\)"):
            Policy(arm, control_timestep=timestep)
    timeless = write(tmp_path / "timeless.frobs", control_timestep=None)
    assert Policy(timeless)
    with pytest.raises(BundleMismatchError, match="has no control timestep"):
        Policy(timeless, control_timestep=0.04)


def test_a_policy_without_a_robot_takes_none(tmp_path: Path) -> None:
    path = write_summing(tmp_path / "sum.frobs")
    with pytest.raises(BundleMismatchError, match="was trained without a robot"):
        Policy(path, robot=ROBOT)
    with pytest.raises(BundleMismatchError, match="trained with none"):
        Policy(path, joint_names=JOINTS)


def test_the_fingerprint_of_a_model_file_is_compared(tmp_path: Path) -> None:
    from frobs_core.models import load_model
    from frobs_models import fingerprint

    urdf = tmp_path / "arm.urdf"
    link = "<link name='{}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
    joint = (
        "<joint name='{}' type='revolute'><parent link='{}'/><child link='{}'/><axis xyz='0 0 1'/>"
        "<limit lower='-1' upper='1' velocity='2' effort='3'/></joint>"
    )
    text = "<robot name='arm'>" + "".join(link.format(name) for name in "abc")
    text += joint.format("shoulder", "a", "b") + joint.format("elbow", "b", "c") + "</robot>"
    urdf.write_text(text)
    robot = {**manifest()["robot"], "fingerprint": fingerprint(load_model(urdf))}
    path = write(tmp_path / "own.frobs", robot=robot)
    assert Policy(path, robot=fingerprint(load_model(urdf)))
    urdf.write_text(text.replace("<robot name='arm'>", "<robot name='other'> <!-- the same -->\n"))
    assert Policy(path, robot=fingerprint(load_model(urdf)))
    urdf.write_text(text.replace("velocity='2'", "velocity='2.5'"))
    with pytest.raises(BundleMismatchError, match="differs from the robot used in training"):
        Policy(path, robot=fingerprint(load_model(urdf)))
    urdf.write_text(text.replace("elbow", "wrist"))
    with pytest.raises(BundleMismatchError, match="the joints are shoulder, wrist"):
        Policy(path, joint_names=load_model(urdf).joint_names)


def test_a_path_in_place_of_a_fingerprint_is_rejected(arm: Path) -> None:
    with pytest.raises(PolicyArgumentError, match="must be a fingerprint of 64"):
        Policy(arm, robot="arm.urdf")


def test_a_change_per_step_is_limited(arm: Path) -> None:
    policy = Policy(arm, max_change=0.25)
    far = observation(1.0, -1.0, 0.0)
    np.testing.assert_array_equal(policy.act(observation(0.0, 0.0, 0.0)), [0.0, 0.0])
    np.testing.assert_array_equal(policy.act(far), [0.25, -0.25])
    np.testing.assert_array_equal(policy.act(far), [0.5, -0.5])
    policy.reset(previous_action=np.array([0.9, 0.0]))
    np.testing.assert_allclose(policy.act(far), [1.0, -0.25])
    policy.reset(previous_action=np.array([3.0, 0.0]))  # outside the action space
    np.testing.assert_array_equal(policy.act(far), [1.0, -0.25])
    policy.reset()
    np.testing.assert_array_equal(policy.act(far), [1.0, -1.0])


def test_the_limit_forgets_the_rows_that_begin_anew(arm: Path) -> None:
    policy = Policy(arm, max_change=0.25)
    policy.act(np.zeros((2, 3), np.float32))
    policy.reset(np.array([False, True]))
    np.testing.assert_array_equal(policy.act(np.ones((2, 3), np.float32)), [[0.25, 0.25], [1.0, 1.0]])
    np.testing.assert_array_equal(policy.act(np.zeros((2, 3), np.float32)), [[0.0, 0.0], [0.75, 0.75]])


def test_the_limit_can_be_that_of_the_joints(arm: Path, tmp_path: Path) -> None:
    policy = Policy(arm, max_change="joint_velocity")  # of the second joint there is none
    policy.reset(previous_action=np.zeros(2))
    np.testing.assert_array_equal(policy.act(observation(1, 1, 0)), observation(0.1, 1.0))
    unknown = write(tmp_path / "unknown.frobs", action={"space": space(2), "max_change": None})
    with pytest.raises(BundleMismatchError, match="the actions of this policy are not joint positions"):
        Policy(unknown, max_change="joint_velocity")


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, [0.1], [0.1, -0.1], "fast"])
def test_a_limit_that_makes_no_sense_is_refused(value: Any, arm: Path, tmp_path: Path) -> None:
    with pytest.raises(PolicyArgumentError, match=r"^max_change is "):
        Policy(arm, max_change=value)
    with pytest.raises(PolicyArgumentError, match="discrete actions cannot be limited"):
        Policy(write_choosing(tmp_path / "choice.frobs"), max_change=0.1)


@pytest.mark.parametrize("value", [[0.0], [math.nan, 0.0], np.zeros((2, 3))])
def test_a_previous_action_that_makes_no_sense_is_refused(value: Any, arm: Path) -> None:
    with pytest.raises(PolicyArgumentError, match="previous_action"):
        Policy(arm).reset(previous_action=np.array(value))


def test_an_action_that_is_not_finite_never_leaves_the_policy(tmp_path: Path) -> None:
    from bundles import graph
    from onnx import TensorProto, helper

    diverged = graph(
        [helper.make_node("MatMul", ["observation", "pick"], ["action"])],
        {"observation": (TensorProto.FLOAT, (3,))},
        {"action": (TensorProto.FLOAT, (2,))},
        pick=np.full((3, 2), np.nan, np.float32),
    )
    with pytest.raises(BundleError, match="an action that is not finite"):
        Policy(write(tmp_path / "nan.frobs", diverged)).act(np.ones(3, np.float32))


def test_latency_is_measured(arm: Path) -> None:
    policy = Policy(arm)
    assert str(policy.latency) == "no action yet"
    for _ in range(20):
        policy.act(observation(1, 2, 3))
    found = policy.latency
    assert found.actions == 20
    assert 0.0 < found.median <= found.percentile_95 <= found.largest < 1000.0
    assert "median" in str(found)
    assert policy.bench(5).actions == 5
    assert policy.latency.actions == 0


@pytest.mark.parametrize(
    "arguments",
    [
        {"robot": 5},
        {"joint_names": 5},
        {"joint_names": [1, 2]},
        {"control_timestep": "a"},
        {"control_timestep": [0.04]},
        {"max_change": [1, "a"]},
        {"max_change": [[1], [1, 2]]},
        {"max_change": {}},
        {"num_threads": 1.5},
        {"num_threads": math.inf},
        {"num_threads": 0},
    ],
)
def test_arguments_of_a_wrong_type_are_named(arm: Path, arguments: dict[str, Any]) -> None:
    [name] = arguments
    with pytest.raises(PolicyArgumentError, match=f"^{name} is "):
        Policy(arm, **arguments)


@pytest.mark.parametrize("value", ["a", [[1.0], [1.0, 2.0]], {}])
def test_values_that_are_no_numbers_are_named(arm: Path, value: Any) -> None:
    policy = Policy(arm)
    with pytest.raises(PolicyArgumentError, match=r"^previous_action is "):
        policy.reset(previous_action=value)
    with pytest.raises(BundleMismatchError, match="observation"):
        policy.act(value)
    with pytest.raises(BundleMismatchError, match="observation"):
        policy.act({"height": value, "joint_positions": np.array([1.0, 2.0])})
    with pytest.raises(PolicyArgumentError, match=r"^actions is "):
        policy.bench(value)


def test_a_policy_says_which_camera_took_its_images(tmp_path: Path) -> None:
    policy = Policy(write_seeing(tmp_path / "eye.frobs"))
    assert policy.manifest.images == {
        "eye": Image(
            camera="wrist",
            modality="rgb",
            unit="1",
            frame="robot/hand",
            pos=(0.0, 0.0, 0.1),
            target=(0.0, 0.0, 1.0),
            fov_y=60.0,
            markers=True,
        )
    }
    picture = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)
    assert policy.act({"eye": picture}) == pytest.approx(8.5 / 255.0)
    wrongs: list[tuple[Any, str]] = [
        (picture.astype(np.float32), r"has the type float32, not uint8; convert it with astype\(np.uint8\)"),
        (picture.transpose(2, 0, 1), r"has shape \(3, 2, 3\), not \(2, 3, 3\)"),
    ]
    for wrong, message in wrongs:
        with pytest.raises(BundleMismatchError, match=message):
            policy.act({"eye": wrong})


@pytest.mark.parametrize(
    ("images", "message"),
    [
        ({"ear": IMAGE}, "'ear' is missing"),
        ({"eye": {**IMAGE, "pos": [0.0, 1.0]}}, "values to unpack"),
        ({"eye": {key: value for key, value in IMAGE.items() if key != "camera"}}, "'camera' is missing"),
        ({"eye": "wrist"}, "is damaged"),
        ([], "is damaged"),
        ({"flat": IMAGE}, r"expected \(height, width, channels\)"),
    ],
)
def test_a_record_of_images_that_makes_no_sense_is_refused(images: Any, message: str, tmp_path: Path) -> None:
    pixels = {"type": "Box", "shape": [2, 3, 3], "dtype": "uint8", "low": 0, "high": 255}
    parts = {"spaces": {"eye": pixels, "flat": space(3)}, "terms": [], "images": images}
    with pytest.raises(BundleError, match=message):
        Policy(write(tmp_path / "eye.frobs", observation=parts))


def test_a_bundle_without_a_record_of_images_is_read(arm: Path) -> None:
    assert Policy(arm).manifest.images == {}
