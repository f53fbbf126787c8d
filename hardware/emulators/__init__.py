"""The devices' side of the wire: they speak real bytes; what they report comes from a given source."""
