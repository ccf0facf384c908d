"""The languages of the pages: `texts` finds the words, one TOML file a language has them."""
