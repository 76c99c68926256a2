"""What measuring tools share: waveforms, recording, alignment, repeats."""
