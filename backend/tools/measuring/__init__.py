"""Parts that measuring tools share: waveforms, recording, alignment, repeats."""
