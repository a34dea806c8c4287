"""Defects planted by tests: text that identifies them, so that no stored run is taken for them."""
import functools
import types


def fingerprint(what, seen=()):
    """Text that identifies a planted defect: its instructions, constants, and arguments, and those of the functions it calls.

    A name would not do: a run made with another factor under the same name would be taken up.
    """
    if isinstance(what, functools.partial):
        return f"partial({fingerprint([what.func, what.args, what.keywords], seen)})"
    if isinstance(what, types.FunctionType):
        if id(what) in seen:
            return what.__qualname__
        seen = (*seen, id(what))
        cells = [cell.cell_contents for cell in what.__closure__ or ()]
        # functions that it calls in its own file; those of the harness are in `_sources`
        names = sorted(_names(what.__code__) & what.__globals__.keys())
        called = [what.__globals__[name] for name in names]
        called = [f for f in called if isinstance(f, types.FunctionType) and f.__module__ == what.__module__]
        return fingerprint(["function", what.__code__, what.__defaults__, what.__kwdefaults__, cells, called], seen)
    if isinstance(what, types.CodeType):
        return f"code({what.co_code.hex()} {what.co_names} {fingerprint(what.co_consts, seen)})"
    if isinstance(what, dict):
        return "{" + ", ".join(f"{key!r}: {fingerprint(value, seen)}" for key, value in what.items()) + "}"
    if isinstance(what, (list, tuple)):
        return "[" + ", ".join(fingerprint(part, seen) for part in what) + "]"
    return repr(what)


def _names(code):
    """Names that a function and its inner functions use."""
    return set(code.co_names).union(*(_names(part) for part in code.co_consts if isinstance(part, types.CodeType)))
