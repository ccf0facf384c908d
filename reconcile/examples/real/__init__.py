"""Measured axes that others have published: their recordings and nominal models as an engineer has them."""
