"""Pure codecs that more than one door needs."""
