"""Truncated quantile critics."""

from __future__ import annotations

import sb3_contrib
from pydantic import NonNegativeInt

from frobs_algos_sb3.networks import QuantileConfig
from frobs_algos_sb3.off_policy import OffPolicy
from frobs_algos_sb3.sac import SACConfig


class TQCConfig(SACConfig):
    """Settings of TQC, with the defaults of sb3-contrib.

    Attributes:
        top_quantiles_to_drop_per_net: Number of quantiles that are dropped per critic, starting with the highest.
    """

    top_quantiles_to_drop_per_net: NonNegativeInt = 2
    policy_kwargs: QuantileConfig = QuantileConfig()


class TQC(OffPolicy):
    """Truncated quantile critics (Kuznetsov et al. 2020)."""

    name = "tqc"
    config_model = TQCConfig
    model_class = sb3_contrib.TQC
