"""Live charts: rows decimated to the chart's width, sent as binary frames, drawn by ECharts."""
