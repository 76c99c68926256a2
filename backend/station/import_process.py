"""The process of an import: ``python -m backend.station.import_process MIB`` of memory at most.

What a file takes to be read is not known before: its elements may take forty times their bytes.
"""

from __future__ import annotations

import sys

from drivers.computer.processes import limit_memory, yield_processor
from profiles.importer.process import main

if __name__ == "__main__":
    # STOP and the buses go first, however many files are read.
    yield_processor()
    most_mib = int(sys.argv[1])
    limit_memory(most_mib << 20)
    main(most_mib)
