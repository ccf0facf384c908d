"""The Tuning page: what `servo-ctrl tune` has measured, proposed and proved."""
