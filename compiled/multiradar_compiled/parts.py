"""Compilation of functions that are only called from compiled functions.

numba makes each function ready to run, and therefore optimises and translates it together with all
that it calls: a function at a depth of ten is optimised and translated ten times. A part is only
lowered; it is optimised and translated with the kernels that call it.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, _LowerResult
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

# numba has no type annotations of it.
_default_passes: Any = DefaultPassBuilder.define_nopython_pipeline


class PartCompiler(CompilerBase):
    """The passes of numba, the last of which leaves a function untranslated."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes: Any = _default_passes(self.state)
        passes.passes = [
            (_Lowering if one is NativeLowering else one, name) for one, name in passes.passes
        ]
        passes.finalize()
        return [passes]


class _Library(JITCodeLibrary):
    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]  # numba's
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]  # as above
class _Lowering(NativeLowering):
    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.flags.no_compile = True
        state.library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
        state.library.__class__ = _Library
        super().run_pass(state)  # type: ignore[no-untyped-call]  # as above
        # What callers find it by, in place of the function that would run.
        key = object()
        lowered = state["cr"]
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = _LowerResult(lowered.fndesc, lowered.call_helper, cfunc=key, env=lowered.env)
        return True
