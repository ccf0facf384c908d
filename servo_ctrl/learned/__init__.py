"""The versioned store of learned results, which a crash neither loses nor leaves partially written."""
