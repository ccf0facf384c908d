"""Tables of the documents, made from the figures and declarations that are committed beside them."""
