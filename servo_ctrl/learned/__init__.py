"""The versioned store of learned results. Nothing learned is lost or half written."""
