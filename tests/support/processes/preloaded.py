"""What commands load when they start: modules and compiled kernels.

Imported once by the process from which commands are forked (`support.processes.commands`). What is
not in the cache of kernels is left to the command.
"""

from importlib import import_module

from multiradar_compiled.ahead import missing_kernels
from multiradar_compiled.kernel_list import kernels_for
from multiradar_compiled.worker import compile_kernel

import_module("support.processes.command_modules")

wanted = kernels_for(["serve imm", "serve two-stage", "track imm", "track two-stage"])
missing = missing_kernels(wanted)
for one in wanted:
    if one not in missing:
        compile_kernel(one.kernel, list(one.arguments))
