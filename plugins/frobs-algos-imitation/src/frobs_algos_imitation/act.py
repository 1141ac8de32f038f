"""Action chunking."""

from __future__ import annotations

from typing import Any, ClassVar

from torch import nn

from frobs_algos_imitation.bc import BC
from frobs_algos_imitation.config import ChunkConfig, ImitationConfig
from frobs_algos_imitation.networks import ChunkTransformer
from frobs_algos_imitation.policy import ImitationPolicy
from frobs_core.util.errors import ParameterValueError


class ACT(BC):
    """Action chunking with a transformer and temporal ensembling (Zhao et al. 2023), without a latent variable."""

    name: ClassVar[str] = "act"
    config_model: ClassVar[type[ImitationConfig]] = ChunkConfig

    _config: ChunkConfig

    @property
    def _chunk(self) -> int:
        return self._config.chunk

    def _make_policy(self) -> ImitationPolicy:
        config, space = self._config, self.action_space
        if config.width % config.heads:
            raise ParameterValueError(
                "heads", config.heads, f"a divisor of width = {config.width}", f"algorithm '{self.name}'"
            )
        make: Any = self._make_network
        return ImitationPolicy(self.observation_space, space, make, config.history, config.chunk, config.ensemble)  # type: ignore[arg-type]

    def _make_network(self, frame: int, action: int, points: int) -> nn.Module:
        config = self._config
        layers = config.encoder_layers, config.decoder_layers
        return ChunkTransformer(config.history, frame, action, points, config.chunk, config.width, config.heads, layers)
