"""The paper's tables and figures, and the plain raising of many agents that they are made of."""
