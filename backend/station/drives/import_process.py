"""Process of an import: ``import_process MIB`` as a module, with its memory limit [MiB].

The memory needed for a file is not known beforehand: its elements may take forty times their size
in the file.
"""

from __future__ import annotations

import sys

from drivers.computer.processes import limit_memory, yield_processor
from profiles.importer.process import main

if __name__ == "__main__":
    # STOP and the buses have priority, however many files are read.
    yield_processor()
    most_mib = int(sys.argv[1])
    limit_memory(most_mib << 20)
    main(most_mib)
