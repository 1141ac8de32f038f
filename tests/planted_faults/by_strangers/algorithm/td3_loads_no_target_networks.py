"""When training continues from a checkpoint, the target networks start as copies of the current networks."""

from __future__ import annotations

from frobs_algos_sb3.td3 import TD3


class Faulty(TD3):
    def _read_networks(self, folder):
        super()._read_networks(folder)
        policy = self.model.policy
        policy.actor_target.load_state_dict(policy.actor.state_dict())
        policy.critic_target.load_state_dict(policy.critic.state_dict())
