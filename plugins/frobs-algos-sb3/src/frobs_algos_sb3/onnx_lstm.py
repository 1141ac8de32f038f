"""One LSTM step built from basic arithmetic, which every runtime supports for any number of environments."""

from __future__ import annotations

from typing import Any

import torch as th
from torch import nn

from frobs_core.util.errors import PolicyExportError


class LstmStep(nn.Module):
    """Module that advances an LSTM by one step, and starts each episode with a zero state."""

    def __init__(self, lstm: nn.LSTM) -> None:
        super().__init__()
        if lstm.bidirectional or lstm.proj_size:
            raise PolicyExportError(
                "the LSTM", "bidirectional LSTMs and LSTMs with projected outputs are not supported."
            )
        self.layers, self.hidden_size = lstm.num_layers, lstm.hidden_size
        self.inputs, self.recurrences = nn.ModuleList(), nn.ModuleList()
        for layer in range(lstm.num_layers):
            self.inputs.append(_linear(lstm, f"ih_l{layer}"))
            self.recurrences.append(_linear(lstm, f"hh_l{layer}"))

    def forward(self, features: th.Tensor, hidden: th.Tensor, cell: th.Tensor, start: th.Tensor) -> Any:
        """Return the output, (batch, hidden_size), and the next hidden and cell states.

        Args:
            features: Inputs, (batch, …).
            hidden: Hidden state, (batch, layers, hidden_size).
            cell: Cell state, (batch, layers, hidden_size).
            start: (batch,) bool, True at the start of an episode.
        """
        kept = 1.0 - start.float()[:, None]
        hiddens, cells = [], []
        for layer, (of_input, of_state) in enumerate(zip(self.inputs, self.recurrences, strict=True)):
            gates = of_input(features) + of_state(kept * hidden[:, layer])
            ingoing, kept_share, new, outgoing = th.chunk(gates, 4, dim=-1)
            memory = th.sigmoid(kept_share) * (kept * cell[:, layer]) + th.sigmoid(ingoing) * th.tanh(new)
            features = th.sigmoid(outgoing) * th.tanh(memory)
            hiddens.append(features)
            cells.append(memory)
        return features, th.stack(hiddens, dim=1), th.stack(cells, dim=1)


def _linear(lstm: nn.LSTM, name: str) -> nn.Linear:
    """Return a linear layer with one of the LSTM's weight matrices and the corresponding bias."""
    weight = getattr(lstm, f"weight_{name}")
    layer = nn.Linear(weight.shape[1], weight.shape[0], bias=lstm.bias)
    layer.weight = weight
    if lstm.bias:
        layer.bias = getattr(lstm, f"bias_{name}")
    return layer
