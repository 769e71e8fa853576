"""The rules of the single environment's API, as far as documented: a break is an AssertionError."""

from __future__ import annotations

import copy

import numpy as np

import gymnasium


def _check_return(env, observation, info):
    assert observation in env.observation_space, "observation outside of its space"
    assert isinstance(info, dict)


def check_env(env) -> None:
    assert isinstance(env, gymnasium.Env) and env.unwrapped is env
    for space in (env.observation_space, env.action_space):
        assert np.isfinite(space.low).all() and np.isfinite(space.high).all() and (space.low < space.high).all()
    assert "render_modes" in env.metadata
    result = env.reset()
    assert isinstance(result, tuple) and len(result) == 2
    _check_return(env, *result)
    first, info = env.reset(seed=123)
    state = copy.deepcopy(env.np_random.bit_generator.state)
    again, info_again = env.reset(seed=123)
    assert (first == again).all() and info == info_again, "the same seed begins another episode"
    assert env.np_random.bit_generator.state == state
    env.reset(seed=456)
    assert env.np_random.bit_generator.state != state, "the seed does not reach the generator"
    env.reset(options={})
    result = env.step(env.action_space.sample())
    assert isinstance(result, tuple) and len(result) == 5
    observation, reward, terminated, truncated, info = result
    _check_return(env, observation, info)
    assert isinstance(reward, float) and np.isfinite(reward) and type(terminated) is bool and type(truncated) is bool
    env.close()
    env.close()
