"""Closed-loop replay: the recorded reference through the known controller onto a model."""
