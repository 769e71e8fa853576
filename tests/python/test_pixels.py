"""X-ray pictures as observations: their sizes and bytes, and the laws between picture, masks, tip and projection."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import trocar
import trocar.gym
from conftest import box_vessel
from gymnasium.utils.env_checker import check_env

PIXELS = trocar.Options(start_poses=2, observation="pixels", pixels=(96, 64), channels=("image", "device", "vessel", "depth"))


@pytest.fixture(scope="module")
def task(arch):
    return trocar.Task(arch, PIXELS)


def actions_of(environments, steps):
    generators = [np.random.default_rng(i) for i in range(environments.num_envs)]
    return [np.array([g.uniform([0, -3], [35, 3], (environments.devices, 2)) for g in generators]) for _ in range(steps)]


def through(projection, points):
    p = np.c_[points, np.ones(len(points))] @ projection.T
    return p[:, :2] / p[:, 2:]


def test_a_pixel_environment_keeps_gymnasiums_rules(tube):
    env = trocar.gym.Navigation(tube, start_poses=2, time_limit=2.0, observation="pixels", render_mode="rgb_array")
    assert env.observation_space.shape == (128, 128, 1) and env.observation_space.dtype == np.uint8
    observation, info = env.reset(seed=1)
    assert observation in env.observation_space and info["tip_pixels"].shape == (1, 2)
    picture = env.render()
    assert picture.shape == (128, 128, 3) and picture.dtype == np.uint8 and (picture[:, :, :1] == observation).all()
    again, _ = trocar.gym.Navigation(tube, start_poses=2, time_limit=2.0, observation="pixels").reset(seed=1)
    assert (again == observation).all()
    observation, reward, terminated, truncated, info = env.step(np.array([[35.0, 1.0]]))
    assert observation in env.observation_space and isinstance(reward, float)


def test_both_is_a_dict_of_state_and_pixels(tube):
    both = trocar.gym.Navigation(tube, start_poses=2, time_limit=2.0, observation="both")
    state = trocar.gym.Navigation(tube, start_poses=2, time_limit=2.0)
    seen, _ = both.reset(seed=4)
    assert seen in both.observation_space and (seen["state"] == state.reset(seed=4)[0]).all()
    check_env(state)
    assert state.render() is None
    vector = trocar.gym.VectorEnv(tube, 3, 2, start_poses=2, time_limit=2.0, observation="both", render_mode="rgb_array")
    seen, infos = vector.reset(seed=4)
    assert seen["pixels"].shape == (3, 128, 128, 1) and seen["state"].shape[0] == 3 and seen["pixels"][0] in vector.single_observation_space["pixels"]
    assert infos["tip_pixels"].shape == (3, 1, 2)
    pictures = vector.render()
    assert len(pictures) == 3 and all((picture[:, :, :1] == pixels).all() for picture, pixels in zip(pictures, seen["pixels"]))


def test_pixels_depend_on_neither_threads_nor_batch_size_nor_copies(task):
    def pictures(num_envs, num_threads, copy):
        environments = trocar.Environments(task, num_envs, num_threads, copy=copy)
        rows = [np.array(environments.reset(7)[0])]
        for actions in actions_of(environments, 5):
            rows.append(np.array(environments.step(actions)[0]))
        return np.array(rows)

    of_four = pictures(4, 3, True)
    assert of_four.shape == (6, 4, 64, 96, 4) and of_four.dtype == np.uint8
    assert (of_four == pictures(4, 1, False)).all()
    assert (of_four[:, :2] == pictures(2, 2, True)).all()
    assert (of_four[0] != of_four[-1]).any()


def test_looking_changes_nothing(task):
    def hashes(options):
        environments = trocar.Environments(trocar.Task(task.scene, options), 2, 2)
        environments.reset(3)
        return [environments.step(actions)[4]["hash"].tolist() for actions in actions_of(environments, 4)]

    assert hashes(PIXELS) == hashes(dataclasses.replace(PIXELS, observation="state")) == hashes(dataclasses.replace(PIXELS, observation="both"))


def test_tip_centreline_masks_and_depth_agree_with_the_projection(task):
    environments = trocar.Environments(task, 1, 1)
    environments.reset(0)
    for actions in actions_of(environments, 12):
        observation, _, _, _, infos = environments.step(actions)
    frame, rod = environments.xray(0), environments.rods(0)[0]
    assert frame.image.shape == (64, 96) and frame.image.dtype == np.uint8 and frame.depth.dtype == np.uint16
    for k, channel in enumerate((frame.image, frame.device, frame.vessel, (frame.depth >> 8).astype(np.uint8))):
        assert (observation[0, :, :, k] == channel).all(), PIXELS.channels[k]
    # the law of the pinhole
    assert np.abs(frame.tips[0] - through(frame.projection, rod[-1:])[0]).max() < 1e-9
    assert (infos["tip_pixels"][0] == frame.tips).all()
    line = frame.centrelines[0]
    assert np.abs(line - through(frame.projection, rod[len(rod) - len(line):])).max() < 1e-9
    # masks: 0 or 255; the device lies along its centreline, and within the vessel
    for mask in (frame.device, frame.vessel):
        assert set(np.unique(mask)) == {0, 255}
    rows, columns = np.nonzero(frame.device)
    nearest = np.sqrt(((np.c_[columns + 0.5, rows + 0.5][:, None] - line[None]) ** 2).sum(axis=2)).min(axis=1)
    spacing = np.sqrt((np.diff(line, axis=0) ** 2).sum(axis=1)).max()
    assert nearest.max() < spacing / 2 + 1.5
    assert (frame.vessel[rows, columns] == 255).mean() > 0.95
    # the picture is darker where the device is than beside it; depth is there where a body is
    assert frame.image[frame.device == 255].mean() < frame.image[(frame.vessel == 255) & (frame.device == 0)].mean()
    assert (frame.depth[frame.vessel == 255] > 0).all() and (frame.depth[(frame.vessel == 0) & (frame.device == 0)] == 0).all()


def test_a_simulators_frame_is_its_rendered_picture(tube):
    sim = tube.simulator()
    sim.drive(0, speed=0.03)
    sim.step(50)
    frame = trocar.xray(sim)
    assert (frame.image == sim.render()).all()
    assert np.abs(frame.tips[0] - through(frame.projection, sim.rod(0)[-1:])[0]).max() < 1e-9
    # what the device takes of the light: its mask is where the picture without it would differ
    assert (frame.device > 0).sum() > 0 and frame.image.dtype == np.uint16


def test_the_last_pictures_of_episodes_are_told_beside_the_first_ones(tube):
    options = trocar.Options(start_poses=2, time_limit=0.4, observation="pixels", channels="device")
    environments = trocar.Environments(tube, 2, 1, options=options, autoreset="same_step")
    environments.reset(0)
    for _ in range(6):
        observation, _, _, truncated, infos = environments.step(np.tile([[[35.0, 0.0]]], (2, 1, 1)))
        if truncated.any():
            break
    assert truncated.all() and infos["final_obs"][0].shape == (128, 128, 1)
    assert (infos["final_obs"][0] != observation[0]).any()


def test_views_of_the_scene_are_observed_by_name(hepatic):
    options = trocar.Options(start_poses=1, observation="pixels", view="ap", pixels=(64, 64))
    environments = trocar.Environments(hepatic, options=options)
    first, _ = environments.reset(1)
    assert first.shape == (1, 64, 64, 1) and first.std() > 5
    with pytest.raises(trocar.Error, match='found "front", expected one of "ap", "dsa"'):
        trocar.Environments(hepatic, options=dataclasses.replace(options, view="front"))


def test_bad_options_say_what_is_expected(tube):
    for change, words in [({"observation": "picture"}, "expected one of state, pixels, both"), ({"channels": ("red",)}, "expected some of image"),
                          ({"channels": ()}, "found none"), ({"pixels": (0, 128)}, "8 to 2048"), ({"pixels": (10**9, 128)}, "8 to 2048"),
                          ({"pixels": (64.5, 64)}, "8 to 2048")]:
        with pytest.raises(ValueError, match=words):
            trocar.Environments(tube, options=trocar.Options(start_poses=1, **{"observation": "pixels", **change}))
    with pytest.raises(trocar.Error, match="no views"):
        trocar.Environments(tube, options=trocar.Options(start_poses=1, observation="pixels", view="ap"))
    with pytest.raises(trocar.Error, match="no camera"):
        environments = trocar.Environments(tube, options=trocar.Options(start_poses=1))
        environments.reset(0)
        environments.xray()
    with pytest.raises(ValueError, match="rgb_array"):
        trocar.gym.Navigation(box_vessel(), render_mode="human")
