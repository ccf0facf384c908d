"""The life of a run: check, boot, cycle, record, report. It assembles what the other rooms hold."""
