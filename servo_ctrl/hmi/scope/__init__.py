"""The Scope page: channels of the recording over time, triggered, measured with cursors, and saved."""
