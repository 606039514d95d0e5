"""What commands load when they start: modules and compiled kernels.

Imported once by the process from which commands are forked (`support.processes.commands`). What is
not in the cache of kernels is left to the command.
"""

import gc
from importlib import import_module

from multiradar_compiled.ahead import missing_kernels
from multiradar_compiled.kernel_list import kernels_for
from multiradar_compiled.worker import compile_kernel

# What is loaded here is not searched for garbage, neither now nor in a process that is forked: each
# would have a copy of all of it.
gc.disable()
import_module("support.processes.command_modules")

wanted = kernels_for(["serve imm", "serve two-stage", "track imm", "track two-stage"])
missing = missing_kernels(wanted)
for one in wanted:
    if one not in missing:
        compile_kernel(one.kernel, list(one.arguments))
gc.freeze()
gc.enable()
