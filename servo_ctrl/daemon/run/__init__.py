"""The phases of a run: check, boot, cycle, record, report. It assembles the parts of the other rooms."""
