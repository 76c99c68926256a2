"""The slave information interface (EEPROM): identity words and their checksum.

Source: ETG.1000.6 clause 5.4 and table 16 (word addresses), ETG.2010.
"""

from __future__ import annotations

ALIAS_WORD, CHECKSUM_WORD, SERIAL_WORD = 0x0004, 0x0007, 0x000E
CONFIG_WORDS = 7


def checksum(words: bytes) -> int:
    """CRC-8 of the first seven words: polynomial x⁸+x²+x+1, start value 0xFF (ETG.1000.6 5.4).

    A slave that finds it wrong ignores its EEPROM at the next start.
    """
    crc = 0xFF
    for byte in words[: 2 * CONFIG_WORDS]:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07) & 0xFF if crc & 0x80 else crc << 1
    return crc
